//! `fluxmorph gradient`.

use fluxmorph_optimizer::verify::{Certificate, Certificates, Settings, certify};

use super::args::GradientArgs;
use super::ranks::on_all;
use super::{interrupt, stdout};
use crate::build::{Mode, check_on_ranks, memory_limit, set_up_watched};
use crate::config::{Config, FactorReuse, Region};
use crate::error::Error;
use crate::exit_code::ExitCode;
use crate::files::read_design;

/// Do what the command line says.
pub(super) fn gradient(args: &GradientArgs) -> Result<ExitCode, Error> {
    let signal = interrupt::watch(interrupt::FINISHES_WORK);
    let (mut config, source) = args.common.load()?;
    // The differences are between designs so near to each other that one factor serves them all.
    config.analysis.linear_solver.reuse = FactorReuse::WhileItPays;
    let work = &args.common.work;
    on_all((&config, &source, Mode::Optimisation), work, &signal, |options, mut observer| {
        let interrupted = options.interrupted;
        observer.phase("setting up mesh and matrices");
        let progress = &mut |stage| observer.stage(stage);
        let setup = set_up_watched(&config, &source, Mode::Optimisation, options.ranks, progress)?;
        memory_limit::check_problem(&setup.problem, &source, options.overwrite_policy)?;
        check_on_ranks(&setup, &source)?;
        for warning in &setup.warnings {
            observer.warning(warning);
        }
        let shape = setup.problem.shape().expect("an optimisation has a shape");
        let p = match &args.design {
            Some(path) => {
                let design = read_design(path, shape.surface().variable_count())?;
                design.check_places(shape.surface(), setup.problem.original().bounding_box())?;
                design.values
            }
            None => shape.initial().to_vec(),
        };
        let settings = Settings::default();
        let certificates =
            certify(&setup.problem, &p, &settings, interrupted, |constraint, index, direction| {
                observer.phase(&format!(
                    "{}direction {} of {}: slope {:.4}, difference {:.1e}",
                    constraint.map_or_else(String::new, |name| format!("constraint {name}, ")),
                    index + 1,
                    settings.directions,
                    direction.slope,
                    direction.error
                ));
            })?;
        // No bar may stand where the table goes.
        drop(observer);
        print(&certificates, &settings, work.json, cause_of_differences(&config))
    })
}

/// What may take digits from the differences of a right gradient.
fn cause_of_differences(config: &Config) -> &'static str {
    let has_table = |region: &Region| {
        config.materials.get(&region.material).is_some_and(|own| own.bh.is_some() || own.bh_file.is_some())
    };
    if config.regions.values().any(has_table) {
        "differences lose digits where elements cross a point of a B–H table, at which the curve's second derivative jumps, and by what \
         the residual of the linear solver leaves. A curve in closed form (materials.NAME.saturation) or \
         analysis.linear_solver.tolerance = 1e-14 tells"
    } else {
        "what the residual of the linear solver leaves of differences may be larger than they are, and \
         analysis.linear_solver.tolerance = 1e-14 tells"
    }
}

/// Prints the certificates, as JSON or as tables.
fn print(
    certificates: &Certificates,
    settings: &Settings,
    json: bool,
    cause_of_differences: &str,
) -> Result<ExitCode, Error> {
    let constraints = certificates.constraints.iter().map(|named| (&named.certificate, named.name.as_str()));
    let all: Vec<(&Certificate, &str)> =
        std::iter::once((&certificates.objective, "F")).chain(constraints).collect();
    if json {
        stdout::print_json(certificates)?;
    } else {
        let tables: Vec<String> =
            all.iter().map(|(certificate, name)| table(certificate, name, settings)).collect();
        stdout::print(&tables.join("\n"))?;
    }
    let Some((certificate, name)) = all.into_iter().find(|(certificate, _)| !certificate.holds) else {
        return Ok(ExitCode::Success);
    };
    let is_of_second_order =
        certificate.directions.iter().all(|direction| direction.slope >= settings.least_slope);
    let cure = if is_of_second_order {
        format!("; the slope is that of a right gradient: {cause_of_differences}")
    } else {
        String::new()
    };
    Err(Error::Certificate {
        cause: format!(
            "least slope of {name} {:.4} (at least {} needed), largest relative difference {:.2e} (at most {:e} allowed){cure}",
            certificate.least_slope, settings.least_slope, certificate.largest_error, settings.largest_error
        ),
    })
}

/// The certificate as a table.
fn table(certificate: &Certificate, name: &str, settings: &Settings) -> String {
    let mut text = format!(
        "{name} = {:.10e}\n\nTaylor remainders |F(p + h d) - F(p) - h g.d| / F(p)\n",
        certificate.objective
    );
    text += &format!("{:>10}", "h / span");
    for index in 1..=certificate.directions.len() {
        text += &format!(" {:>12}", format!("direction {index}"));
    }
    text.push('\n');
    let steps = certificate.directions.first().map_or(&[][..], |d| &d.steps);
    for (k, step) in steps.iter().enumerate() {
        text += &format!("{step:>10.3e}");
        for direction in &certificate.directions {
            text += &format!(" {:>12.4e}", direction.remainders[k]);
        }
        text.push('\n');
    }
    let mut row = |name: &str, cell: &dyn Fn(&fluxmorph_optimizer::verify::Direction) -> String| {
        text += &format!("{name:>10}");
        for direction in &certificate.directions {
            text += &format!(" {:>12}", cell(direction));
        }
        text.push('\n');
    };
    row("slope", &|d| format!("{:.4}", d.slope));
    row("adjoint", &|d| format!("{:.5e}", d.adjoint));
    row("central", &|d| format!("{:.5e}", d.difference));
    row("error", &|d| format!("{:.2e}", d.error));
    text += &format!(
        "\nleast slope {:.4} (needed {}), largest error {:.2e} (allowed {:e}): the certificate {}\n",
        certificate.least_slope,
        settings.least_slope,
        certificate.largest_error,
        settings.largest_error,
        if certificate.holds { "holds" } else { "DOES NOT HOLD" }
    );
    text
}
