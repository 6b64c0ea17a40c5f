"""Loads a run directory of Fluxmorph into ParaView: |B| on a cut, and the moving body.

    pvpython examples/paraview/load_run.py RUN_DIR [--screenshot PNG] [--time last|first|best|NUMBER] [--color COLOR]

COLOR is `displacement` [mm] (the default) or `sensitivity`, dF/dx.

In ParaView itself: `FLUXMORPH_RUN=RUN_DIR paraview --script=examples/paraview/load_run.py`, or in its Python shell
`import sys; sys.path.append("examples/paraview"); import load_run; load_run.load("RUN_DIR")`.

Needs ParaView 5.10 or newer, and of a run its `fields.pvd` (output.fields other than "none"); `result.json`,
`resolved.toml` and `optimum.msh` give title, ratio and names of regions where they are there.
"""

import argparse
import base64
import json
import os
import re
import sys
from pathlib import Path

import numpy as np
from paraview import servermanager, simple
from vtkmodules.util.numpy_support import vtk_to_numpy

# Nodes that moved by less than this share of the longest motion have not moved [1].
MOVED = 1e-6
# Edges that are sharper than this part the outside of a mesh into its faces [deg].
SHARP = 20.0

# Runs inside ParaView for every time: the faces of the body are those of the first mesh, since no mesh changes its
# topology; the points are those of the moved mesh.
BODY_SCRIPT = """
import base64
import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray
import vtkmodules.util.numpy_support as support

faces = np.frombuffer(base64.b64decode("{faces}"), dtype="<i4").reshape(-1, 3).astype(np.int64)
direction = np.array({direction})
grid = self.GetInputDataObject(0, 0)
points = support.vtk_to_numpy(grid.GetPoints().GetData())
# Pieces of several ranks repeat the points on their borders.
ids = grid.GetPointData().GetArray("GlobalPointIds")
first = np.unique(support.vtk_to_numpy(ids), return_index=True)[1] if ids else np.arange(len(points))
points = points[first]
used, local = np.unique(faces, return_inverse=True)
cells = np.hstack([np.full((len(faces), 1), 3), local.reshape(-1, 3)]).astype(np.int64)
places = vtkPoints()
places.SetData(numpy_to_vtk(points[used].copy(), deep=1))
triangles = vtkCellArray()
triangles.SetCells(len(faces), support.numpy_to_vtkIdTypeArray(cells.ravel(), deep=1))
output = self.GetOutputDataObject(0)
output.SetPoints(places)
output.SetPolys(triangles)
for name, label, scale in [("displacement", "displacement [mm]", 1e3), ("sensitivity", "sensitivity", 1.0)]:
    array = grid.GetPointData().GetArray(name)
    vectors = scale * support.vtk_to_numpy(array)[first][used] if array else np.zeros((len(used), 3))
    values = vectors @ direction if direction.any() else np.linalg.norm(vectors, axis=1)
    named = numpy_to_vtk(values.copy(), deep=1)
    named.SetName(label)
    output.GetPointData().AddArray(named)
"""


class Run:
    """What the files of a run directory say beside its fields."""

    def __init__(self, folder):
        self.folder = Path(folder)
        self.collection = self.folder / "fields.pvd"
        if not self.collection.is_file():
            sys.exit(f"error: {self.collection} is missing: not a run directory, or one with output.fields = \"none\"")
        result = self.folder / "result.json"
        self.result = json.loads(result.read_text(encoding="utf-8")) if result.is_file() else {}
        resolved = self.folder / "resolved.toml"
        self.resolved = resolved.read_text(encoding="utf-8") if resolved.is_file() else ""

    def title(self):
        found = re.search(r'^title = "(.*)"$', self.resolved, re.MULTILINE)
        return found.group(1) if found else self.folder.name

    def direction(self):
        """Direction of a positive displacement; zeros where every node has its own."""
        design = self.resolved.partition("\n[design]\n")[2].partition("\n[")[0]
        found = re.search(r"^direction = \[(.*)\]$", design, re.MULTILINE)
        vector = np.array([float(part) for part in found.group(1).split(",")]) if found else np.zeros(3)
        return vector / (np.linalg.norm(vector) or 1.0)

    def region_names(self):
        """Names of the regions in the order of their numbers in the fields; empty where they are not known."""
        mesh = self.folder / "optimum.msh"
        if not mesh.is_file():
            return []
        names = {}
        with open(mesh, "rb") as file:
            for line in file:
                found = re.match(rb'3 (\d+) "(.*)"', line)
                if found:
                    # Physical volume 1 is region 0.
                    names[int(found.group(1)) - 1] = found.group(2).decode()
                if line.startswith(b"$EndPhysicalNames"):
                    break
        return [names[number] for number in sorted(names)]

    def materials(self):
        """Names of the regions that are something else than air, and their model."""
        parts = self.resolved.split("\n[regions.")[1:]
        models = {}
        for part in parts:
            name, _, rest = part.partition("]\n")
            body = rest.partition("\n[")[0]
            models[name.strip('"')] = "impedance" if 'model = "impedance"' in body else "volume"
        return models

    def ratio(self):
        objective = self.result.get("objective", {})
        if self.result.get("command") != "run" or objective.get("ratio") is None:
            return ""
        return f"F/F0 = {objective['ratio']:.4f} at evaluation {objective['best_evaluation']}"


def faces_of(tets):
    """Every triangle of the tetrahedra once, its elements on both sides (-1: none), shapes (n, 3), (n, 2)."""
    corners = np.concatenate([tets[:, [1, 2, 3]], tets[:, [0, 3, 2]], tets[:, [0, 1, 3]], tets[:, [0, 2, 1]]])
    owner = np.tile(np.arange(len(tets)), 4)
    order = np.lexsort(np.sort(corners, axis=1).T[::-1])
    corners, owner = corners[order], owner[order]
    key = np.sort(corners, axis=1)
    same = (key[1:] == key[:-1]).all(axis=1)
    first = np.concatenate([[True], ~same])
    sides = np.full((first.sum(), 2), -1)
    sides[:, 0] = owner[first]
    number = np.cumsum(first) - 1
    sides[number[1:][same], 1] = owner[1:][same]
    return corners[first], sides


def hull_patches(points, faces):
    """Which faces of the outside belong to the end of the model, and not to a hole that a body has left in it.

    The outside falls into patches along its sharp edges; a patch belongs to the end where one of its faces lies at
    an end of the bounding box and looks along that axis.
    """
    edges = points[faces]
    normals = np.cross(edges[:, 1] - edges[:, 0], edges[:, 2] - edges[:, 0])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    patch = np.arange(len(faces))
    pairs = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    owner = np.tile(np.arange(len(faces)), 3)
    order = np.lexsort(pairs.T[::-1])
    pairs, owner = pairs[order], owner[order]
    shared = np.flatnonzero((pairs[1:] == pairs[:-1]).all(axis=1))
    a, b = owner[shared], owner[shared + 1]
    smooth = (normals[a] * normals[b]).sum(axis=1) > np.cos(np.radians(SHARP))
    a, b = a[smooth], b[smooth]
    # Every face takes the least number around it, until none changes.
    while True:
        before = patch.copy()
        least = np.minimum(patch[a], patch[b])
        np.minimum.at(patch, a, least)
        np.minimum.at(patch, b, least)
        patch = patch[patch]
        if (patch == before).all():
            break
    low, high = points.min(axis=0), points.max(axis=0)
    rounding = 1e-9 * np.linalg.norm(high - low)
    at_end = (np.abs(edges - low) < rounding) | (np.abs(edges - high) < rounding)
    along = np.abs(normals)[:, None, :] > 0.9
    hull = np.unique(patch[(at_end & along).any(axis=(1, 2))])
    return np.isin(patch, hull)


def whole(grid):
    """Points, tetrahedra, their regions and the displacements of the points, all in the order of the whole mesh.

    Where several ranks have written pieces, each has its own copy of a point on their border; the numbers in the whole
    mesh, which pieces carry, tell which points are one.
    """
    points = vtk_to_numpy(grid.GetPoints().GetData())
    tets = vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(-1, 4)
    region = vtk_to_numpy(grid.GetCellData().GetArray("region"))
    displacement = vtk_to_numpy(grid.GetPointData().GetArray("displacement"))
    nodes, elements = grid.GetPointData().GetArray("GlobalPointIds"), grid.GetCellData().GetArray("GlobalCellIds")
    if nodes and elements:
        nodes, order = vtk_to_numpy(nodes), np.argsort(vtk_to_numpy(elements))
        first = np.unique(nodes, return_index=True)[1]
        points, displacement = points[first], displacement[first]
        tets, region = nodes[tets][order], region[order]
    return points, tets, region, displacement


def body_faces(run, grid):
    """The faces of the bodies that move, shape (n, 3); of all bodies where none moves."""
    points, tets, region, displacement = whole(grid)
    displacement = np.linalg.norm(displacement, axis=1)
    moved = displacement > MOVED * displacement.max()
    corners, sides = faces_of(tets)
    outside = sides[:, 1] < 0
    second = np.where(outside, -1, region[sides[:, 1]])
    first = region[sides[:, 0]]

    names, materials = run.region_names(), run.materials()
    bodies = [number for number, name in enumerate(names) if materials.get(name) == "volume"]
    moving = [number for number in bodies if moved[tets[region == number]].any()]
    bodies = moving or bodies
    is_body = np.isin(first, bodies) != (np.isin(second, bodies) & ~outside)
    chosen = is_body
    if "impedance" in materials.values() or not names:
        # Only where a body has left a hole; a face of the model's end never shows a body.
        hole = np.zeros(len(corners), dtype=bool)
        hole[outside] = ~hull_patches(points, corners[outside])
        chosen = chosen | hole
    if not names:
        chosen = chosen | ((first != second) & ~outside & moved[corners].any(axis=1))
    return corners[chosen]


def box_of(points, margin):
    """Corners of a box around points, larger by a margin of its diagonal on each side."""
    low, high = points.min(axis=0), points.max(axis=0)
    room = margin * np.linalg.norm(high - low)
    return low - room, high + room


def cut_plane(points, body, direction):
    """Origin and normal of a cut through the body along its motion; just inside of a symmetry plane."""
    low, high = body.min(axis=0), body.max(axis=0)
    # The axis across the motion along which the body is longest.
    normal = int(np.argmax(np.where(np.abs(direction) < 0.5, high - low, 0.0)))
    origin = 0.5 * (low + high)
    ends = points[:, normal].min(), points[:, normal].max()
    for end in ends:
        for side in (low[normal], high[normal]):
            if abs(side - end) < 1e-9 * (ends[1] - ends[0]):
                origin[normal] = end + 1e-3 * (0.5 * (ends[0] + ends[1]) - end)
    return origin, np.eye(3)[normal]


def color(display, source, array, title, association="POINTS", preset="Viridis (matplotlib)", limits=None, log=False):
    """Colours by an array, with a bar; returns the bar."""
    view = simple.GetActiveViewOrCreate("RenderView")
    simple.ColorBy(display, (association, array))
    table = simple.GetColorTransferFunction(array)
    table.ApplyPreset(preset, True)
    if limits is not None:
        table.RescaleTransferFunction(*limits)
    if log:
        table.MapControlPointsToLogSpace()
        table.UseLogScale = 1
    bar = simple.GetScalarBar(table, view)
    bar.Title, bar.ComponentTitle = title, ""
    bar.TitleColor = bar.LabelColor = [0.1, 0.1, 0.1]
    bar.TitleFontSize, bar.LabelFontSize = 16, 14
    bar.WindowLocation, bar.ScalarBarLength, bar.Visibility = "Any Location", 0.34, 1
    bar.RangeLabelFormat = "%-#.3g"
    display.SetScalarBarVisibility(view, True)
    return bar


def text(content, place, size):
    view = simple.GetActiveViewOrCreate("RenderView")
    source = simple.Text(Text=content)
    display = simple.Show(source, view)
    display.WindowLocation, display.Position = "Any Location", place
    display.FontSize, display.Color = size, [0.1, 0.1, 0.1]


def load(folder, time="last", by="displacement"):
    """Builds the pipeline and the view of a run directory; `time` is last, first, best or an evaluation."""
    run = Run(folder)
    reader = simple.PVDReader(registrationName=run.folder.name, FileName=str(run.collection))
    reader.UpdatePipelineInformation()
    times = [float(value) for value in reader.TimestepValues] or [0.0]
    best = run.result.get("objective", {}).get("best_evaluation")
    wanted = {"last": times[-1], "first": times[0], "best": times[-1] if best is None else float(best)}
    now = wanted[time] if time in wanted else float(time)
    if now not in times:
        sys.exit(f"error: evaluation {now:g} has no field file; there are {', '.join(f'{t:g}' for t in times)}")
    reader.UpdatePipeline(times[-1])
    last = servermanager.Fetch(reader)
    grid = last.GetBlock(0) if last.IsA("vtkMultiBlockDataSet") else last
    faces, direction = body_faces(run, grid), run.direction()
    # What is up in the view; bodies that move along their normals have no direction of their own.
    up = direction if direction.any() else np.array([0.0, 0.0, 1.0])
    points = whole(grid)[0]
    body_points = points[np.unique(faces)] if len(faces) else points

    view = simple.GetActiveViewOrCreate("RenderView")
    view.UseColorPaletteForBackground = 0
    view.Background = [1.0, 1.0, 1.0]
    view.OrientationAxesLabelColor = [0.1, 0.1, 0.1]
    view.ViewSize = [1280, 800]
    scene = simple.GetAnimationScene()
    scene.UpdateAnimationUsingDataTimeSteps()
    scene.AnimationTime = now
    view.ViewTime = now

    if len(faces):
        encoded = base64.b64encode(faces.astype("<i4").tobytes()).decode()
        body = simple.ProgrammableFilter(registrationName="moving body", Input=reader)
        body.OutputDataSetType = "vtkPolyData"
        body.Script = BODY_SCRIPT.format(faces=encoded, direction=direction.tolist())
        body.UpdatePipeline(now)
        shown = simple.Show(body, view)
        shown.Representation = "Surface With Edges"
        shown.EdgeColor = [0.25, 0.25, 0.25]
        shown.LineWidth = 0.5
        array, unit = ("displacement [mm]", "displacement [mm]") if by == "displacement" else (by, "dF/dx [F/m]")
        bar = color(shown, body, array, unit)
        bar.Position = [0.88, 0.08]

    low, high = box_of(body_points, 0.3)
    # Fields of a slice, of the surroundings of the body only: far away there is nothing to see.
    origin, normal = cut_plane(points, body_points, up)
    cut = simple.Slice(registrationName="cut", Input=reader)
    cut.SliceType.Origin, cut.SliceType.Normal = origin.tolist(), normal.tolist()
    near = simple.Clip(registrationName="|B|", Input=cut, ClipType="Box")
    near.Exact = 1
    near.ClipType.Position, near.ClipType.Length = low.tolist(), (high - low).tolist()
    near.UpdatePipeline(now)
    shown = simple.Show(near, view)
    # Colours as in the bar, without shadows.
    shown.Ambient, shown.Diffuse, shown.Specular = 1.0, 0.0, 0.0
    # An amplitude of zero has no place on a log scale: three decades below the largest one are shown.
    largest = near.CellData["B_abs"].GetRange()[1] if near.CellData.GetNumberOfArrays() else 0.0
    if largest > 0.0:
        bar = color(shown, near, "B_abs", "B_abs [T]", "CELLS", "Inferno (matplotlib)", (1e-3 * largest, largest), True)
        bar.Position = [0.88, 0.52]
    simple.Hide(reader, view)
    simple.Hide(cut, view)

    text(run.title(), [0.02, 0.93], 22)
    text(f"shown: evaluation {now:g}    {run.ratio()}", [0.02, 0.885], 15)

    # From the side that moves, so that the cut stands behind the body and is seen from its open side.
    side = np.eye(3)[np.argmax(np.abs(up))] * np.sign(up[np.argmax(np.abs(up))])
    away = normal * (1.0 if origin @ normal < 0.5 * (low + high) @ normal + 1e-12 else -1.0)
    aside = np.cross(side, away)
    middle = 0.5 * (body_points.min(axis=0) + body_points.max(axis=0))
    distance = np.linalg.norm(high - low)
    view.CameraFocalPoint = middle.tolist()
    view.CameraPosition = (middle + distance * (0.75 * side + 1.0 * away + 0.55 * aside)).tolist()
    view.CameraViewUp = side.tolist()
    view.CenterOfRotation = middle.tolist()
    view.CameraParallelProjection = 1
    view.CameraParallelScale = 0.4 * distance
    simple.Render(view)
    return view


def main(arguments):
    parser = argparse.ArgumentParser(description="Loads a run directory of Fluxmorph into ParaView.")
    parser.add_argument("run", metavar="RUN_DIR")
    parser.add_argument("--screenshot", metavar="PNG", help="write the view to this file")
    parser.add_argument("--time", default="last", help="last, first, best, or the number of an evaluation")
    parser.add_argument("--color", default="displacement", choices=["displacement", "sensitivity"])
    options = parser.parse_args(arguments)
    view = load(options.run, options.time, options.color)
    if options.screenshot:
        simple.SaveScreenshot(options.screenshot, view, ImageResolution=view.ViewSize, CompressionLevel="9")
        print(f"wrote {options.screenshot}")


if __name__ == "__main__":
    main(sys.argv[1:])
elif __name__ == "__vtkconsole__" and os.environ.get("FLUXMORPH_RUN"):
    # ParaView's own console and `paraview --script`.
    load(os.environ["FLUXMORPH_RUN"])
