#!/usr/bin/env python3
"""Draws the optimised plate of a run directory: `tools/picture.py RUN_DIRECTORY OUTPUT.png`.

Needs pyvista. The moving face is coloured by thickness, seen from the observation side, mirrored to the whole plate.
"""

import json
import sys
from pathlib import Path

import numpy as np
import pyvista as pv

PLATE = 2  # number of the region `plate` in the shield's mesh


def main(run: Path, output: Path) -> None:
    result = json.loads((run / "result.json").read_text())
    best = result["objective"]["best_evaluation"]
    mesh = pv.read(run / "fields" / f"eval_{best:04d}.vtu")
    plate = mesh.extract_cells(np.flatnonzero(mesh.cell_data["region"] == PLATE))
    quarter = plate.extract_surface(algorithm="dataset_surface")
    parts = [quarter]
    parts += [part.reflect((1, 0, 0), point=(0, 0, 0)) for part in list(parts)]
    parts += [part.reflect((0, 1, 0), point=(0, 0, 0)) for part in list(parts)]
    whole = pv.merge(parts)
    whole.points = whole.points * 1e3
    whole.point_data["thickness [mm]"] = -whole.points[:, 2]

    plotter = pv.Plotter(off_screen=True, window_size=(1200, 760))
    plotter.set_background("white")
    plotter.add_mesh(
        whole,
        scalars="thickness [mm]",
        cmap="viridis",
        clim=(0, 30),
        show_edges=True,
        edge_color="#00000030",
        line_width=0.5,
        scalar_bar_args={"vertical": True, "color": "black", "position_x": 0.87, "position_y": 0.15, "height": 0.7},
    )
    plotter.add_text(
        f"F/F0 = {result['objective']['ratio']:.4f} after {result['evaluations']} evaluations",
        font_size=13,
        color="black",
    )
    plotter.camera_position = [(520, -560, -620), (0, 0, -12), (0, 0, -1)]
    plotter.camera.zoom(1.1)
    plotter.screenshot(str(output))


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
