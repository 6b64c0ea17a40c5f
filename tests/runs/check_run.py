"""Reads a run directory of the shield plate as a user of ParaView would: through VTK.

    python check_run.py RUN_DIRECTORY [RUN_DIRECTORY ...]

A test tool: `just test-pyvista` installs pyvista and runs it. It shares no code with the program, and ends with an
error at the first thing that is not as docs/configuration.md says.
"""

import csv
import json
import sys
from pathlib import Path

import numpy as np
import pyvista

# Name: number of components.
POINT_ARRAYS = {
    "A_re": 3, "A_im": 3, "psi_re": 1, "psi_im": 1, "displacement": 3, "sensitivity": 3, "thickness": 1,
}
CELL_ARRAYS = {"B_re": 3, "B_im": 3, "B_abs": 1, "J_re": 3, "J_im": 3, "loss_density": 1, "region": 1, "quality": 1}

# Rounding of coordinates below 1 m and of the interpolation [m], with room.
LENGTH_ROUNDING = 1e-15
# Relative rounding of the sum over all elements.
SUM_ROUNDING = 1e-12


def require(holds, message):
    """Ends the program unless `holds`; unlike `assert`, also under -O."""
    if not holds:
        sys.exit(f"error: {message}")


def check_arrays(name, arrays, expected, length):
    require(set(arrays.keys()) == set(expected), f"{name}: arrays {sorted(arrays.keys())}")
    for key, components in expected.items():
        values = np.asarray(arrays[key])
        shape = (length,) if components == 1 else (length, components)
        require(values.shape == shape, f"{name}: {key} has the shape {values.shape}, not {shape}")
        require(np.isfinite(values).all(), f"{name}: {key} is not finite")


def check_field(path, mesh, result):
    """Counts, cell types, arrays and volumes of one field file."""
    require(mesh.n_points == result["mesh"]["nodes"], f"{path.name}: {mesh.n_points} points")
    require(mesh.n_cells == result["mesh"]["tets"], f"{path.name}: {mesh.n_cells} cells")
    require((mesh.celltypes == pyvista.CellType.TETRA).all(), f"{path.name}: cells that are no tetrahedra")
    check_arrays(path.name, mesh.point_data, POINT_ARRAYS, mesh.n_points)
    check_arrays(path.name, mesh.cell_data, CELL_ARRAYS, mesh.n_cells)
    corners = mesh.points[mesh.cells_dict[pyvista.CellType.TETRA]]
    edges = corners[:, 1:] - corners[:, :1]
    volumes = np.linalg.det(edges) / 6.0
    require((volumes > 0.0).all(), f"{path.name}: inverted elements")
    parts = np.hstack([mesh.cell_data["B_re"], mesh.cell_data["B_im"]])
    magnitude = np.linalg.norm(parts, axis=1)
    agree = np.allclose(magnitude, mesh.cell_data["B_abs"], rtol=1e-14, atol=0.0)
    require(agree, f"{path.name}: B_abs is not the magnitude of B_re and B_im")
    return volumes


def check_thickness(initial, final, design):
    """The far face in the moved mesh lies where the control grid of 7 by 13 points puts it."""
    p = np.asarray(design["values_m"]).reshape(7, 13)
    points = np.asarray(design["points_m"])
    grid = np.stack(np.meshgrid(0.02 * np.arange(7), 0.02 * np.arange(13), indexing="ij"), axis=-1).reshape(-1, 2)
    in_order = np.allclose(points[:, :2], grid, rtol=0.0, atol=LENGTH_ROUNDING)
    require(in_order, "design.points_m are not in the order of the control grid")
    start, end = initial.points, final.points
    # Mesh lines are far more than a nanometre apart.
    on_plate = (abs(start[:, 2] + 0.01) < 1e-9) & (start[:, 0] < 0.12 + 1e-9) & (start[:, 1] < 0.24 + 1e-9)
    require(on_plate.sum() >= 91, f"{on_plate.sum()} nodes on the far face of the plate")
    x, y = start[on_plate, 0] / 0.02, start[on_plate, 1] / 0.02
    i, j = (x + 1e-9).astype(int).clip(0, 5), (y + 1e-9).astype(int).clip(0, 11)
    s, t = x - i, y - j
    near, far = (1 - t) * p[i, j] + t * p[i, j + 1], (1 - t) * p[i + 1, j] + t * p[i + 1, j + 1]
    expected = 0.01 + (1 - s) * near + s * far
    thickness = -end[on_plate, 2]
    error = abs(thickness - expected).max()
    require(error < LENGTH_ROUNDING, f"the plate differs from its design by {error} m")
    require((end[on_plate, :2] == start[on_plate, :2]).all(), "nodes of the far face have left their place in x, y")
    difference = abs(end - start - final.point_data["displacement"]).max()
    require(difference < LENGTH_ROUNDING, f"the displacement differs from the moved points by {difference} m")
    measured = final.point_data["thickness"][on_plate]
    require(abs(measured - thickness).max() < LENGTH_ROUNDING, "the thickness is not that of the moved points")
    return thickness


def check_run(folder):
    result = json.loads((folder / "result.json").read_text())
    status = json.loads((folder / "manifest.json").read_text())["status"]
    require(status == result["status"], f"the manifest says {status}, the result {result['status']}")
    with open(folder / "history.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    require(len(rows) == result["evaluations"], f"{len(rows)} rows for {result['evaluations']} evaluations")

    reader = pyvista.get_reader(folder / "fields.pvd")
    files = sorted((folder / "fields").glob("*.vtu"))
    evaluations = [int(path.stem.removeprefix("eval_")) for path in files]
    require(list(reader.time_values) == evaluations, f"times of the PVD {list(reader.time_values)}")
    fields = {}
    for path, evaluation in zip(files, evaluations):
        mesh = pyvista.read(path)
        volumes = check_field(path, mesh, result)
        reader.set_active_time_value(evaluation)
        through_collection = reader.read()[0]
        require(np.array_equal(through_collection.points, mesh.points), f"the PVD leads elsewhere than {path.name}")
        fields[evaluation] = (mesh, volumes)

    best = result["objective"]["best_evaluation"]
    mesh, volumes = fields[best]
    thickness = check_thickness(fields[0][0], mesh, result["design"])
    row = rows[best]
    for name, value in [("min_thickness_m", thickness.min()), ("max_thickness_m", thickness.max())]:
        require(abs(float(row[name]) - value) < LENGTH_ROUNDING, f"{name} of the history: {row[name]}, not {value}")
    loss = float((mesh.cell_data["loss_density"] * volumes).sum())
    meshed = loss > 0.0
    if meshed:
        total = sum(result["losses_w"].values())
        require(abs(loss / total - 1.0) < SUM_ROUNDING, f"the loss in the fields is {loss} W, not {total} W")
    model = f"meshed plate, {loss:.6g} W" if meshed else "impedance surface"
    print(
        f"OK {folder.name}: {len(files)} fields of {mesh.n_points} points and {mesh.n_cells} cells, "
        f"plate {thickness.min() * 1e3:.3f} to {thickness.max() * 1e3:.3f} mm as designed, {model}"
    )


def main():
    require(len(sys.argv) > 1, "usage: check_run.py RUN_DIRECTORY [RUN_DIRECTORY ...]")
    print(f"pyvista {pyvista.__version__}, VTK {pyvista.vtk_version_info}")
    for folder in sys.argv[1:]:
        check_run(Path(folder))


if __name__ == "__main__":
    main()
