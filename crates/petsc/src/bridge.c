/* The calls into MPI and PETSc that the program makes, as plain functions of plain numbers.
 *
 * What is a macro, an inline function or a type of unknown width in the headers of the two libraries is dealt with here, by
 * the C compiler that read them. Complex numbers are pairs of doubles, real part first. Functions return 0, or a code that is
 * not 0, with a text in `fm_message`. All functions but those of one rank are collective.
 */
#include <limits.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <mpi.h>
#include <petscksp.h>

#if !defined(PETSC_USE_COMPLEX)
#error "this PETSc has real numbers: fluxmorph needs one that was configured with --with-scalar-type=complex"
#endif

/* The first text of the last error. */
static char message[1024];

const char *fm_message(void) { return message; }

static void say(const char *text) {
    if (message[0] == 0) {
        snprintf(message, sizeof message, "%s", text);
    }
}

int fm_rank(void);
int fm_size(void);
void fm_abort(int code);

/* PETSc reports an error once in every function on the way back: the first text is the cause. */
static PetscErrorCode on_error(MPI_Comm comm, int line, const char *function, const char *file, PetscErrorCode code,
                               PetscErrorType type, const char *text, void *context) {
    (void)comm, (void)line, (void)file, (void)type, (void)context;
    if (text != NULL && text[0] != 0 && message[0] == 0) {
        snprintf(message, sizeof message, "%s (PETSc, %s)", text, function);
    }
    /* One rank alone may be out of memory, and the others wait for it in what all do together. */
    int is_memory = code == PETSC_ERR_MEM || (function != NULL && strstr(function, "Malloc") != NULL);
    if (is_memory && fm_size() > 1) {
        fprintf(stderr, "error: rank %d of %d is out of memory: %s\n", fm_rank(), fm_size(), message);
        fm_abort(4);
    }
    return code;
}

/* ---- ranks ---- */

int fm_start(void) {
    int given = 0;
    if (MPI_Init_thread(NULL, NULL, MPI_THREAD_SERIALIZED, &given) != MPI_SUCCESS || given < MPI_THREAD_SERIALIZED) {
        say("MPI does not start with MPI_THREAD_SERIALIZED");
        return 1;
    }
    /* Signals are the program's own, and a file in the working directory has no say. */
    static char name[] = "fluxmorph", quiet[] = "-no_signal_handler", alone[] = "-skip_petscrc";
    static char *words[] = {name, quiet, alone, NULL};
    char **arguments = words;
    int count = 3;
    PetscErrorCode code = PetscInitialize(&count, &arguments, NULL, NULL);
    if (code != 0) {
        say("PETSc does not start");
        return 1;
    }
    /* Standard output is the program's, for data. */
    PETSC_STDOUT = stderr;
    return (int)PetscPushErrorHandler(on_error, NULL);
}

int fm_finish(void) {
    int code = (int)PetscFinalize();
    MPI_Finalize();
    return code;
}

int fm_rank(void) {
    int rank = 0;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    return rank;
}

int fm_size(void) {
    int size = 1;
    MPI_Comm_size(MPI_COMM_WORLD, &size);
    return size;
}

/* How many ranks this machine has. */
int fm_size_here(void) {
    MPI_Comm here;
    int size = 1;
    if (MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &here) == MPI_SUCCESS) {
        MPI_Comm_size(here, &size);
        MPI_Comm_free(&here);
    }
    return size;
}

void fm_abort(int code) { MPI_Abort(MPI_COMM_WORLD, code); }

/* Numbers that one MPI call takes at most. */
#define PORTION ((int64_t)1 << 28)

static int portion(int64_t left) { return (int)(left < PORTION ? left : PORTION); }

void fm_broadcast(double *numbers, int64_t count) {
    for (int64_t done = 0; done < count; done += PORTION) {
        MPI_Bcast(numbers + done, portion(count - done), MPI_DOUBLE, 0, MPI_COMM_WORLD);
    }
}

/* Sums over all ranks, at rank 0. */
void fm_sum(double *numbers, int64_t count) {
    int root = fm_rank() == 0;
    for (int64_t done = 0; done < count; done += PORTION) {
        double *at = numbers + done;
        MPI_Reduce(root ? MPI_IN_PLACE : at, at, portion(count - done), MPI_DOUBLE, MPI_SUM, 0, MPI_COMM_WORLD);
    }
}

/* The counts of all ranks, at rank 0: `all` has room for them there. */
void fm_gather_counts(int64_t own, int64_t *all) {
    MPI_Gather(&own, 1, MPI_INT64_T, all, 1, MPI_INT64_T, 0, MPI_COMM_WORLD);
}

/* The numbers of all ranks one after the other, at rank 0: `all` has room for them there. */
void fm_gather(const double *own, int64_t count, double *all, const int64_t *counts) {
    const int tag = 1;
    if (fm_rank() != 0) {
        for (int64_t done = 0; done < count; done += PORTION) {
            MPI_Send(own + done, portion(count - done), MPI_DOUBLE, 0, tag, MPI_COMM_WORLD);
        }
        return;
    }
    if (count > 0) {
        memcpy(all, own, (size_t)count * sizeof *own);
    }
    double *at = all + count;
    for (int rank = 1; rank < fm_size(); rank++) {
        for (int64_t done = 0; done < counts[rank]; done += PORTION) {
            MPI_Recv(at + done, portion(counts[rank] - done), MPI_DOUBLE, rank, tag, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
        }
        at += counts[rank];
    }
}

/* ---- options ---- */

/* Puts options, as PETSc's command line has them, into the database of all solvers. */
int fm_options(const char *text) {
    message[0] = 0;
    return (int)PetscOptionsInsertString(NULL, text);
}

/* Sets an option unless it is set already. */
int fm_option_default(const char *name, const char *value) {
    message[0] = 0;
    PetscBool is_set = PETSC_FALSE;
    PetscErrorCode code = PetscOptionsHasName(NULL, NULL, name, &is_set);
    if (code == 0 && !is_set) {
        code = PetscOptionsSetValue(NULL, name, value);
    }
    return (int)code;
}

/* Whether a solver of any rank has asked for an option; the database has names without their hyphen. */
int fm_option_used(const char *name) {
    PetscBool is_used = PETSC_FALSE;
    PetscOptionsUsed(NULL, name[0] == '-' ? name + 1 : name, &is_used);
    int own = is_used ? 1 : 0, any = 0;
    MPI_Allreduce(&own, &any, 1, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
    return any;
}

/* ---- solvers ---- */

/* The prolongation from a coarse space onto own rows: entries of row i are at starts[i] .. starts[i + 1]. Columns below `own` are
 * this rank's, the `shared` ones after them those of all ranks; `diagonal_factor` is what the diagonal of these is multiplied by. */
typedef struct {
    const uint32_t *starts, *columns;
    const double *weights;
    int64_t own, shared;
    double diagonal_factor;
} fm_coarse_space;

typedef struct {
    Mat matrix;
    KSP ksp;
    Vec right_side, solution, residual;
    /* Of the iteration for complex symmetric matrices; NULL where PETSc iterates. */
    Vec preconditioned, direction, image;
    /* Of the second level; NULL where there is one alone. */
    PC smoother;
    Mat prolongation, coarse_matrix;
    KSP coarse;
    Vec rest, restricted, correction;
    /* Of the coarse columns of this rank, how many are its own, how many there are, and what the diagonal of the others is
     * multiplied by. */
    PetscInt coarse_own, coarse_here;
    PetscReal diagonal_factor;
    PetscInt own, first;
    PetscReal tolerance;
    int most;
} fm_solver;

void fm_solver_destroy(fm_solver *solver) {
    if (solver == NULL) {
        return;
    }
    KSPDestroy(&solver->ksp);
    MatDestroy(&solver->matrix);
    VecDestroy(&solver->right_side);
    VecDestroy(&solver->solution);
    VecDestroy(&solver->residual);
    VecDestroy(&solver->preconditioned);
    VecDestroy(&solver->direction);
    VecDestroy(&solver->image);
    PCDestroy(&solver->smoother);
    MatDestroy(&solver->prolongation);
    MatDestroy(&solver->coarse_matrix);
    KSPDestroy(&solver->coarse);
    VecDestroy(&solver->rest);
    VecDestroy(&solver->restricted);
    VecDestroy(&solver->correction);
    free(solver);
}

/* Whether all ranks got through a part of the work that was each one's own: none may wait for one that did not. */
static int agree(PetscErrorCode code) {
    int own = code != 0, any = 0;
    MPI_Allreduce(&own, &any, 1, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
    if (any) {
        say(own ? "PETSc gave an error without a text" : "another rank failed");
    }
    return any;
}

#define TRY(call)                                                                                                              \
    do {                                                                                                                       \
        PetscErrorCode code = (call);                                                                                          \
        if (code != 0) {                                                                                                       \
            say("PETSc gave an error without a text");                                                                         \
            return (int)code;                                                                                                  \
        }                                                                                                                      \
    } while (0)

/* x += Q (b - K x) with Q = P (P' K P)^-1 P': the residual has no coarse part then. The coarse space is real: P' is plain. */
static PetscErrorCode correct(fm_solver *solver, Vec right_side, Vec solution) {
    TRY(MatMult(solver->matrix, solution, solver->rest));
    TRY(VecAYPX(solver->rest, -1.0, right_side));
    TRY(MatMultTranspose(solver->prolongation, solver->rest, solver->restricted));
    TRY(KSPSolve(solver->coarse, solver->restricted, solver->correction));
    TRY(MatMultAdd(solver->prolongation, solver->correction, solution, solution));
    return 0;
}

/* z = S r + Q (r - K S r), with the preconditioner S of the options: "A-DEF2" of Tang, Nabben, Vuik and Erlangga, J. Sci.
 * Comput. 39 (2009) 340. */
static PetscErrorCode apply_two_levels(PC pc, Vec right_side, Vec solution) {
    fm_solver *solver = NULL;
    TRY(PCShellGetContext(pc, &solver));
    TRY(PCApply(solver->smoother, right_side, solution));
    TRY(correct(solver, right_side, solution));
    return 0;
}

/* The first of the shared columns that a rank holds, of `shared` that are spread over `size` ranks. */
static PetscInt first_shared(PetscInt shared, int size, int rank) {
    return (PetscInt)((int64_t)shared * rank / size);
}

/* Inserts the rows of the prolongation; no rank waits for another. Every rank has its own columns first and its part of the
 * shared ones behind them. */
static PetscErrorCode insert_prolongation(fm_solver *solver, const fm_coarse_space *space, int rank, int size) {
    const PetscInt *ranges = NULL;
    TRY(MatGetOwnershipRangesColumn(solver->prolongation, &ranges));
    PetscInt own = (PetscInt)space->own, shared = (PetscInt)space->shared;
    for (PetscInt row = 0; row < solver->own; row++) {
        for (uint32_t k = space->starts[row]; k < space->starts[row + 1]; k++) {
            PetscInt column = (PetscInt)space->columns[k], global = ranges[rank] + column;
            if (column >= own) {
                /* The last rank whose first one is not beyond it. */
                int holder = (int)(((int64_t)(column - own + 1) * size - 1) / shared);
                global = ranges[holder + 1] - (first_shared(shared, size, holder + 1) - (column - own));
            }
            TRY(MatSetValue(solver->prolongation, solver->first + row, global, space->weights[k], INSERT_VALUES));
        }
    }
    return 0;
}

/* Puts a second level behind the preconditioner that the options name. The coarse solver is called as the solver itself, with
 * `coarse_`. */
static int add_coarse_level(fm_solver *solver, const char *prefix, const fm_coarse_space *space) {
    int rank = 0, size = 1;
    MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
    MPI_Comm_size(PETSC_COMM_WORLD, &size);
    PetscInt shared = (PetscInt)space->shared;
    solver->coarse_own = (PetscInt)space->own;
    solver->coarse_here = solver->coarse_own + first_shared(shared, size, rank + 1) - first_shared(shared, size, rank);
    solver->diagonal_factor = space->diagonal_factor;
    /* An entry of a shared column may be in one held here or elsewhere; neither block has more entries a row than columns. */
    PetscInt *inside = NULL, *outside = NULL, elsewhere = shared - (solver->coarse_here - solver->coarse_own);
    TRY(PetscMalloc2(solver->own + 1, &inside, solver->own + 1, &outside));
    for (PetscInt row = 0; row < solver->own; row++) {
        PetscInt length = (PetscInt)(space->starts[row + 1] - space->starts[row]);
        inside[row] = PetscMin(length, solver->coarse_here);
        outside[row] = PetscMin(length, elsewhere);
    }
    TRY(MatCreateAIJ(PETSC_COMM_WORLD, solver->own, solver->coarse_here, PETSC_DETERMINE, PETSC_DETERMINE, 0, inside, 0, outside,
                     &solver->prolongation));
    TRY(PetscFree2(inside, outside));
    if (agree(insert_prolongation(solver, space, rank, size))) {
        return 1;
    }
    TRY(MatAssemblyBegin(solver->prolongation, MAT_FINAL_ASSEMBLY));
    TRY(MatAssemblyEnd(solver->prolongation, MAT_FINAL_ASSEMBLY));
    TRY(MatCreateVecs(solver->prolongation, &solver->restricted, &solver->rest));
    TRY(VecDuplicate(solver->restricted, &solver->correction));
    TRY(KSPCreate(PETSC_COMM_WORLD, &solver->coarse));
    TRY(KSPSetOptionsPrefix(solver->coarse, prefix));
    TRY(KSPAppendOptionsPrefix(solver->coarse, "coarse_"));
    TRY(KSPSetFromOptions(solver->coarse));
    TRY(KSPGetPC(solver->ksp, &solver->smoother));
    TRY(PetscObjectReference((PetscObject)solver->smoother));
    PC both = NULL;
    TRY(PCCreate(PETSC_COMM_WORLD, &both));
    TRY(PCSetType(both, PCSHELL));
    TRY(PCShellSetContext(both, solver));
    TRY(PCShellSetApply(both, apply_two_levels));
    TRY(KSPSetPC(solver->ksp, both));
    TRY(PCDestroy(&both));
    return 0;
}

static int create(fm_solver *solver, int64_t count, const int32_t *inside, const int32_t *outside, const char *prefix,
                double tolerance, int max_iterations, int symmetric, const fm_coarse_space *coarse) {
    PetscInt own = solver->own;
    if (count > (int64_t)PETSC_MAX_INT) {
        say("more equations than this PETSc can number: it needs one configured with --with-64-bit-indices");
        return 1;
    }
    TRY(MatCreate(PETSC_COMM_WORLD, &solver->matrix));
    TRY(MatSetSizes(solver->matrix, own, own, (PetscInt)count, (PetscInt)count));
    TRY(MatSetOptionsPrefix(solver->matrix, prefix));
    TRY(MatSetType(solver->matrix, MATAIJ));
    PetscInt *entries[2] = {NULL, NULL};
    const int32_t *given[2] = {inside, outside};
    for (int part = 0; part < 2; part++) {
        TRY(PetscMalloc1(own + 1, &entries[part]));
        for (PetscInt row = 0; row < own; row++) {
            entries[part][row] = given[part][row];
        }
    }
    TRY(MatSeqAIJSetPreallocation(solver->matrix, 0, entries[0]));
    TRY(MatMPIAIJSetPreallocation(solver->matrix, 0, entries[0], 0, entries[1]));
    TRY(PetscFree(entries[0]));
    TRY(PetscFree(entries[1]));
    TRY(MatSetOption(solver->matrix, MAT_SYMMETRIC, PETSC_TRUE));
    TRY(MatSetOption(solver->matrix, MAT_SYMMETRY_ETERNAL, PETSC_TRUE));
    TRY(MatGetOwnershipRange(solver->matrix, &solver->first, NULL));
    TRY(MatCreateVecs(solver->matrix, &solver->solution, &solver->right_side));
    TRY(VecDuplicate(solver->right_side, &solver->residual));
    solver->tolerance = tolerance;
    solver->most = max_iterations;
    if (symmetric) {
        TRY(VecDuplicate(solver->right_side, &solver->preconditioned));
        TRY(VecDuplicate(solver->right_side, &solver->direction));
        TRY(VecDuplicate(solver->right_side, &solver->image));
    }
    TRY(KSPCreate(PETSC_COMM_WORLD, &solver->ksp));
    TRY(KSPSetOptionsPrefix(solver->ksp, prefix));
    TRY(KSPSetTolerances(solver->ksp, tolerance, 0.0, PETSC_DEFAULT, max_iterations));
    TRY(KSPSetFromOptions(solver->ksp));
    return coarse == NULL ? 0 : add_coarse_level(solver, prefix, coarse);
}

/* A solver for `count` equations, of which this rank owns `own`; `inside` and `outside` are the entries of each own row in
 * the columns of this rank and in those of others; `symmetric` for the iteration of `cocg`; `coarse` is NULL for one
 * level. */
int fm_solver_create(int64_t own, int64_t count, const int32_t *inside, const int32_t *outside, const char *prefix,
                     double tolerance, int max_iterations, int symmetric, const fm_coarse_space *coarse,
                     fm_solver **created) {
    message[0] = 0;
    fm_solver *solver = calloc(1, sizeof *solver);
    *created = solver;
    if (solver == NULL) {
        say("no memory");
        return 1;
    }
    solver->own = (PetscInt)own;
    return create(solver, count, inside, outside, prefix, tolerance, max_iterations, symmetric, coarse);
}

/* The name of what KSPSolve ended with. */
const char *fm_reason(int reason) { return KSPConvergedReasons[reason]; }

/* Inserts values into the own rows; no rank waits for another. */
static PetscErrorCode insert_values(fm_solver *solver, const uint32_t *starts, const uint32_t *columns, const uint32_t *numbers,
                                    const double *values) {
    PetscInt longest = 0;
    for (PetscInt row = 0; row < solver->own; row++) {
        PetscInt length = (PetscInt)(starts[row + 1] - starts[row]);
        longest = length > longest ? length : longest;
    }
    PetscInt *at = NULL;
    TRY(PetscMalloc1(longest + 1, &at));
    for (PetscInt row = 0; row < solver->own; row++) {
        PetscInt length = (PetscInt)(starts[row + 1] - starts[row]), number = solver->first + row;
        for (PetscInt k = 0; k < length; k++) {
            at[k] = (PetscInt)numbers[columns[starts[row] + (uint32_t)k]];
        }
        const PetscScalar *entries = (const PetscScalar *)(values + 2 * (size_t)starts[row]);
        TRY(MatSetValues(solver->matrix, 1, &number, length, at, entries, INSERT_VALUES));
    }
    TRY(PetscFree(at));
    return 0;
}

/* What cannot be applied on this rank though it was set up, and why; an earlier failure stays. */
typedef struct {
    const char *what;
    PCFailedReason reason;
} failure;

static PetscErrorCode check_preconditioner(PC pc, const char *what, failure *found) {
    PCFailedReason reason = PC_NOERROR;
    TRY(PCGetFailedReasonRank(pc, &reason));
    if (reason != PC_NOERROR && found->reason == PC_NOERROR) {
        *found = (failure){what, reason};
    }
    return 0;
}

/* Multiplies the diagonal entries of the shared columns. */
static PetscErrorCode raise_diagonal(fm_solver *solver) {
    if (solver->diagonal_factor == 1.0) {
        return 0;
    }
    PetscScalar *entries = NULL;
    TRY(MatGetDiagonal(solver->coarse_matrix, solver->correction));
    TRY(VecGetArray(solver->correction, &entries));
    for (PetscInt column = solver->coarse_own; column < solver->coarse_here; column++) {
        entries[column] *= solver->diagonal_factor;
    }
    TRY(VecRestoreArray(solver->correction, &entries));
    TRY(MatDiagonalSet(solver->coarse_matrix, solver->correction, INSERT_VALUES));
    return 0;
}

/* Factors what the second level has of the matrix. */
static PetscErrorCode set_up_coarse_level(fm_solver *solver, failure *found) {
    MatReuse reuse = solver->coarse_matrix == NULL ? MAT_INITIAL_MATRIX : MAT_REUSE_MATRIX;
    TRY(MatPtAP(solver->matrix, solver->prolongation, reuse, PETSC_DEFAULT, &solver->coarse_matrix));
    TRY(raise_diagonal(solver));
    TRY(MatSetOption(solver->coarse_matrix, MAT_SYMMETRIC, PETSC_TRUE));
    TRY(KSPSetOperators(solver->coarse, solver->coarse_matrix, solver->coarse_matrix));
    TRY(KSPSetUp(solver->coarse));
    PC pc = NULL;
    TRY(KSPGetPC(solver->coarse, &pc));
    TRY(check_preconditioner(pc, "the factor of the coarse level", found));
    TRY(PCSetOperators(solver->smoother, solver->matrix, solver->matrix));
    TRY(PCSetUp(solver->smoother));
    TRY(PCSetUpOnBlocks(solver->smoother));
    TRY(check_preconditioner(solver->smoother, "the factor of a subdomain", found));
    return 0;
}

/* Takes values: entries of own row i are at starts[i] .. starts[i + 1], in columns whose numbers in the distributed matrix are
 * numbers[columns[..]]. */
int fm_solver_set(fm_solver *solver, const uint32_t *starts, const uint32_t *columns, const uint32_t *numbers,
                  const double *values) {
    message[0] = 0;
    if (agree(insert_values(solver, starts, columns, numbers, values))) {
        return 1;
    }
    TRY(MatAssemblyBegin(solver->matrix, MAT_FINAL_ASSEMBLY));
    TRY(MatAssemblyEnd(solver->matrix, MAT_FINAL_ASSEMBLY));
    TRY(KSPSetOperators(solver->ksp, solver->matrix, solver->matrix));
    TRY(KSPSetUp(solver->ksp));
    TRY(KSPSetUpOnBlocks(solver->ksp));
    PC pc = NULL;
    failure found = {NULL, PC_NOERROR};
    TRY(KSPGetPC(solver->ksp, &pc));
    TRY(check_preconditioner(pc, "the preconditioner", &found));
    if (solver->coarse != NULL) {
        TRY(set_up_coarse_level(solver, &found));
    }
    int failed = found.reason != PC_NOERROR, any = 0;
    MPI_Allreduce(&failed, &any, 1, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
    if (any) {
        if (failed) {
            snprintf(message, sizeof message, "%s failed: %s", found.what, PCFailedReasons[found.reason]);
        }
        say("the preconditioner of another rank failed");
        return 1;
    }
    return 0;
}

/* Conjugate orthogonal conjugate gradients (van der Vorst and Melissen, IEEE Trans. Magn. 26, 1990) from the present solution:
 * PETSc's own conjugate gradients for complex symmetric matrices end where the real part of p'Kp changes its sign. */
static int cocg(fm_solver *solver, PetscReal target, PetscInt *done, KSPConvergedReason *reason) {
    PC pc = NULL;
    TRY(KSPGetPC(solver->ksp, &pc));
    if (solver->coarse != NULL) {
        /* For residuals without a coarse part the two levels are complex symmetric, and the iteration keeps them so. */
        TRY(correct(solver, solver->right_side, solver->solution));
    }
    TRY(MatMult(solver->matrix, solver->solution, solver->residual));
    TRY(VecAYPX(solver->residual, -1.0, solver->right_side));
    PetscScalar rho = 1.0, before = 1.0, curvature = 1.0;
    *reason = KSP_DIVERGED_ITS;
    for (*done = 0; *done < solver->most; (*done)++) {
        PetscReal size = 0.0;
        TRY(VecNorm(solver->residual, NORM_2, &size));
        if (size <= target) {
            *reason = KSP_CONVERGED_RTOL;
            return 0;
        }
        TRY(PCApply(pc, solver->residual, solver->preconditioned));
        TRY(VecTDot(solver->residual, solver->preconditioned, &rho));
        if (*done == 0) {
            TRY(VecCopy(solver->preconditioned, solver->direction));
        } else {
            TRY(VecAYPX(solver->direction, rho / before, solver->preconditioned));
        }
        TRY(MatMult(solver->matrix, solver->direction, solver->image));
        TRY(VecTDot(solver->direction, solver->image, &curvature));
        if (rho == 0.0 || curvature == 0.0 || PetscIsInfOrNanScalar(rho / curvature)) {
            *reason = KSP_DIVERGED_BREAKDOWN;
            return 0;
        }
        TRY(VecAXPY(solver->solution, rho / curvature, solver->direction));
        TRY(VecAXPY(solver->residual, -rho / curvature, solver->image));
        before = rho;
    }
    return 0;
}

/* Solves from zero for the own rows of the right side, again from what was reached where the true relative residual has
 * stayed above `tolerance`; overwrites the own rows of the solution. */
int fm_solver_solve(fm_solver *solver, const double *right_side, double *solution, double tolerance, int *iterations,
                    double *residual, int *reason) {
    message[0] = 0;
    /* The recurrence of an iteration and the true residual part by a few digits: a second attempt mends that, a third is rare. */
    const int attempts = 3;
    PetscScalar *at = NULL;
    size_t bytes = 2 * sizeof(double) * (size_t)solver->own;
    TRY(VecGetArray(solver->right_side, &at));
    memcpy(at, right_side, bytes);
    TRY(VecRestoreArray(solver->right_side, &at));
    TRY(VecSet(solver->solution, 0.0));
    PetscReal scale = 0.0, left = 0.0, before = PETSC_MAX_REAL;
    TRY(VecNorm(solver->right_side, NORM_2, &scale));
    *iterations = 0;
    *residual = 0.0;
    *reason = 0;
    for (int attempt = 0; scale > 0.0 && attempt < attempts; attempt++) {
        if (*iterations >= solver->most) {
            break;
        }
        PetscInt done = 0;
        KSPConvergedReason ended = KSP_CONVERGED_ITERATING;
        if (solver->direction != NULL) {
            TRY(cocg(solver, solver->tolerance * scale, &done, &ended));
        } else {
            TRY(KSPSetInitialGuessNonzero(solver->ksp, attempt > 0 ? PETSC_TRUE : PETSC_FALSE));
            TRY(KSPSolve(solver->ksp, solver->right_side, solver->solution));
            TRY(KSPGetIterationNumber(solver->ksp, &done));
            TRY(KSPGetConvergedReason(solver->ksp, &ended));
        }
        *iterations += (int)done;
        *reason = (int)ended;
        TRY(MatMult(solver->matrix, solver->solution, solver->residual));
        TRY(VecAYPX(solver->residual, -1.0, solver->right_side));
        TRY(VecNorm(solver->residual, NORM_2, &left));
        *residual = (double)(left / scale);
        if (*residual <= tolerance || ended < 0 || !(left < 0.5 * before)) {
            break;
        }
        before = left;
    }
    const PetscScalar *found = NULL;
    TRY(VecGetArrayRead(solver->solution, &found));
    memcpy(solution, found, bytes);
    TRY(VecRestoreArrayRead(solver->solution, &found));
    return 0;
}
