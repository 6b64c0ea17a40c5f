"""Reads a run directory of Fluxmorph with pandas and pyvista.

    python3 examples/python/read_run.py RUN_DIR [--picture PNG] [--plain]

Prints the history, the best design, the probes, and |B| along a line through the first probe; draws the designed
surface of the best evaluation, coloured by how far it has moved. `--plain` needs nothing but Python and leaves the
fields and the picture out. `pip install pandas pyvista` gets the rest.
"""

import argparse
import csv
import json
import math
from pathlib import Path


def read_plain(folder):
    """History as a list of rows, result as a dictionary: all that needs no fields."""
    result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    with open(folder / "history.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return rows, result


def print_plain(rows, result):
    objective = result["objective"]
    print(f"{result['status']}: {result['stop_reason']} after {result['evaluations']} evaluations")
    print(f"F/F0 {objective['ratio']:.4f} at evaluation {objective['best_evaluation']}")
    if objective.get("verified_ratio") is not None:
        is_cut = (objective.get("verification") or {}).get("mesh") == "cut"
        print(f"F/F0 {objective['verified_ratio']:.4f} on {'cut elements' if is_cut else 'a fresh mesh'}")
    row = rows[objective["best_evaluation"]]
    if row["min_thickness_m"]:
        low, high = 1e3 * float(row["min_thickness_m"]), 1e3 * float(row["max_thickness_m"])
        print(f"thickness {low:.2f} to {high:.2f} mm")
    values = [1e3 * value for value in result["design"]["values_m"]]
    print(f"{len(values)} design variables from {min(values):.2f} to {max(values):.2f} mm")
    for probe in result["probes"]:
        for point, re, im in zip(probe["points_m"], probe["b_re_t"], probe["b_im_t"]):
            # A probe that the moved mesh no longer holds is null.
            if re is None:
                continue
            magnitude = math.sqrt(sum(part * part for part in re + im))
            place = ", ".join(f"{1e3 * x:g}" for x in point)
            print(f"probe {probe['name']!r} at ({place}) mm: |B| = {1e3 * magnitude:.4g} mT")


def print_history(folder):
    import pandas

    history = pandas.read_csv(folder / "history.csv", index_col="evaluation")
    history["min_mm"] = 1e3 * history["min_thickness_m"]
    history["max_mm"] = 1e3 * history["max_thickness_m"]
    columns = ["objective", "ratio", "step_norm", "worst_quality", "min_mm", "max_mm"]
    print(history[columns].dropna(axis="columns", how="all").to_string(float_format="%.4g"))


def field_of(folder, evaluation):
    """The fields of one evaluation, through the collection that ParaView opens too."""
    import pyvista

    reader = pyvista.get_reader(folder / "fields.pvd")
    times = list(reader.time_values)
    reader.set_active_time_value(float(evaluation) if evaluation in times else times[-1])
    return joined(reader.read()[0])


def joined(mesh):
    """The mesh in its own order: where several ranks have written pieces, each has a copy of a point on their border."""
    import numpy as np
    import pyvista

    if "GlobalPointIds" not in mesh.point_data:
        return mesh
    nodes, order = mesh.point_data["GlobalPointIds"], np.argsort(mesh.cell_data["GlobalCellIds"])
    first = np.unique(nodes, return_index=True)[1]
    tets = nodes[mesh.cells_dict[pyvista.CellType.TETRA]][order]
    whole = pyvista.UnstructuredGrid({pyvista.CellType.TETRA: tets}, mesh.points[first])
    for name in mesh.point_data.keys():
        whole.point_data[name] = mesh.point_data[name][first]
    for name in mesh.cell_data.keys():
        whole.cell_data[name] = mesh.cell_data[name][order]
    return whole


def print_line(mesh, result, points=6):
    """|B| on a line along z through the first probe, over a tenth of the model's height."""
    import pyvista

    center = next((p["points_m"][0] for p in result["probes"]), mesh.center)
    reach = 0.05 * (mesh.bounds[5] - mesh.bounds[4])
    # Slightly aside, so that the line does not run along faces between elements.
    aside = 1e-4 * mesh.length
    start = (center[0] + aside, center[1] + 2 * aside, center[2] - reach)
    end = (start[0], start[1], center[2] + reach)
    line = pyvista.Line(start, end, resolution=points - 1).sample(mesh)
    print("     z mm      |B| mT")
    for point, b, inside in zip(line.points, line["B_abs"], line["vtkValidPointMask"]):
        print(f"{1e3 * point[2]:9.2f}" + (f"{1e3 * b:12.4f}" if inside else "     outside"))


def draw(mesh, picture, title):
    """The faces that moved most, coloured by their displacement."""
    import numpy as np
    import pyvista

    # Faces of the bodies: the outside of the mesh, holes of bodies that are not meshed included, and the faces
    # between regions.
    parts = [mesh.extract_cells(np.flatnonzero(mesh["region"] == region)) for region in np.unique(mesh["region"])]
    surface = pyvista.merge([part.extract_surface(algorithm="dataset_surface") for part in parts], merge_points=False)
    surface["displacement mm"] = 1e3 * np.linalg.norm(surface["displacement"], axis=1)
    largest = surface["displacement mm"].max()
    if largest == 0.0:
        print("nothing has moved: no picture")
        return
    corners = surface.regular_faces
    moved = (surface["displacement mm"][corners] > 1e-6 * largest).any(axis=1)
    shown = surface.extract_cells(np.flatnonzero(moved))
    plotter = pyvista.Plotter(off_screen=True, window_size=(1000, 700))
    plotter.set_background("white")
    plotter.add_mesh(shown, scalars="displacement mm", cmap="viridis", show_edges=True, opacity=0.9)
    plotter.add_text(title, font_size=12, color="black")
    plotter.camera_position = "iso"
    plotter.screenshot(str(picture))
    print(f"wrote {picture}")


def main():
    parser = argparse.ArgumentParser(description="Reads a run directory of Fluxmorph.")
    parser.add_argument("run", metavar="RUN_DIR", type=Path)
    parser.add_argument("--picture", metavar="PNG", type=Path, help="draw the moved faces into this file")
    parser.add_argument("--plain", action="store_true", help="nothing but Python's own library")
    options = parser.parse_args()
    rows, result = read_plain(options.run)
    print_plain(rows, result)
    if options.plain:
        return
    print_history(options.run)
    mesh = field_of(options.run, result["objective"]["best_evaluation"])
    print(f"{mesh.n_points} points, {mesh.n_cells} cells: {', '.join(sorted(mesh.array_names))}")
    print_line(mesh, result)
    if options.picture:
        draw(mesh, options.picture, f"F/F0 = {result['objective']['ratio']:.4f}")


if __name__ == "__main__":
    main()
