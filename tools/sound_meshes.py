#!/usr/bin/env python3
"""Makes sound meshes of five types of device with Gmsh: `pip install gmsh`, then `python3 tools/sound_meshes.py DIR [COUNT]`.

Every device is COUNT (40) meshes with sizes, cells, algorithms, orders, units and file formats by chance (fixed seed), and a
configuration beside each: `fluxmorph check` must have nothing against any of them. docs/robustness.md has the counts.
"""

import random
import sys
from pathlib import Path

import gmsh

UNITS = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254}
COIL = """
[[coils]]
name = "coil"
shape = "circular"
ampere_turns = "1 kA"
center = [{center}]
radius = {radius}
width = {width}
height = {height}
"""


class Device:
    """A model in metres; written in a unit by chance."""

    def __init__(self, name, chance):
        self.name, self.chance = name, chance
        self.scale = 1.0
        self.text = ""
        gmsh.clear()
        gmsh.model.add(name)
        self.unit = chance.choice(list(UNITS))
        self.scale = 1.0 / UNITS[self.unit]
        self.occ = gmsh.model.occ

    def box(self, low, high):
        low, high = [[self.scale * c for c in p] for p in (low, high)]
        return 3, self.occ.addBox(*low, *[h - l for l, h in zip(low, high)])

    def cylinder(self, low, height, radius, angle=6.283185307179586):
        low = [self.scale * c for c in low]
        return 3, self.occ.addCylinder(*low, 0, 0, self.scale * height, self.scale * radius, angle=angle)

    def ball(self, radius, angle=6.283185307179586, lower=-1.5707963267948966):
        return 3, self.occ.addSphere(0, 0, 0, self.scale * radius, angle1=lower, angle3=angle)

    def fragment(self, whole, parts):
        """Cuts the whole by the parts: the pieces of every part, and what is left of the whole."""
        _, pieces = self.occ.fragment([whole], parts)
        self.occ.synchronize()
        own = [[tag for _, tag in piece] for piece in pieces[1:]]
        taken = {tag for piece in own for tag in piece}
        return own, [tag for _, tag in pieces[0] if tag not in taken]

    def region(self, name, tags):
        gmsh.model.addPhysicalGroup(3, tags, name=name)

    def faces(self):
        """Outer faces of the model with their boxes in metres."""
        skin = gmsh.model.getBoundary(gmsh.model.getEntities(3), combined=True, oriented=False)
        return {tag: [c / self.scale for c in gmsh.model.getBoundingBox(2, tag)] for _, tag in skin}

    def surfaces(self, **planes):
        """Named planes `x_min=(axis, place)`; the remaining outer faces are `outer`."""
        faces = self.faces()
        size = max(abs(c) for box in faces.values() for c in box)
        for name, (axis, place) in planes.items():
            on = [t for t, b in faces.items() if all(abs(b[k] - place) < 1e-5 * size for k in (axis, axis + 3))]
            gmsh.model.addPhysicalGroup(2, on, name=name)
            for tag in on:
                del faces[tag]
        if faces:
            gmsh.model.addPhysicalGroup(2, list(faces), name="outer")

    def write(self, directory, cell, fine, regions):
        """Meshes with cells of these sizes (of the whole, and of the named regions), and writes mesh and configuration."""
        chance = self.chance
        points = lambda tags: gmsh.model.getBoundary([(3, t) for t in tags], recursive=True)
        gmsh.model.mesh.setSize(gmsh.model.getEntities(0), self.scale * cell)
        for tags in regions:
            gmsh.model.mesh.setSize(points(tags), self.scale * fine)
        option = gmsh.option.setNumber
        option("Mesh.Algorithm3D", chance.choice([1, 1, 4, 10]))
        option("Mesh.Optimize", 1)
        option("Mesh.ElementOrder", 1)
        option("Mesh.MshFileVersion", chance.choice([2.2, 4.1]))
        option("Mesh.Binary", chance.choice([0, 1]))
        gmsh.model.mesh.generate(3)
        if chance.random() < 0.2:
            gmsh.model.mesh.setOrder(2)
        gmsh.write(str(directory / f"{self.name}.msh"))
        head = f'title = "{self.name}"\n[mesh]\nfile = "{self.name}.msh"\nunit = "{self.unit}"\n'
        (directory / f"{self.name}.toml").write_text(head + self.text)


def plate(d):
    """A plate over a round coil, a quarter; half of them in layers by extrusion."""
    r, thick, wide = d.chance.uniform(0.05, 0.2), d.chance.uniform(0.004, 0.02), d.chance.uniform(0.1, 0.25)
    away = d.chance.uniform(2.5, 6) * r
    side = max(away, 1.5 * wide)
    layered = d.chance.random() < 0.5
    if layered:
        own, air = layers(d, wide, side, [-away, r, r + thick, away])
    else:
        (own,), air = d.fragment(d.box((0, 0, -away), (side, side, away)), [d.box((0, 0, r), (wide, wide, r + thick))])
    d.region("plate", own)
    d.region("air", air)
    d.surfaces(x_min=(0, 0), y_min=(1, 0))
    d.text = (
        '[analysis]\nfrequency = 50\n[materials.m]\nconductivity = 1e6\n[regions.plate]\nmaterial = "m"\n'
        + COIL.format(center="0, 0, 0", radius=0.6 * r, width=0.2 * r, height=0.2 * r)
        + '[boundaries]\nflux_parallel = ["x_min", "y_min", "outer"]\n'
    )
    return side / 4, wide / d.chance.uniform(4, 8), [] if layered else [own]


def layers(d, wide, side, heights):
    """A plate of three thin layers between layers of air, all extruded from one plane."""
    geo, s = gmsh.model.geo, d.scale
    corner = lambda x, y: geo.addPoint(s * x, s * y, s * heights[0])
    points = [corner(*p) for p in [(0, 0), (wide, 0), (wide, wide), (0, wide), (side, 0), (side, side), (0, side)]]
    line = lambda a, b: geo.addLine(points[a], points[b])
    shared = [line(1, 2), line(2, 3)]
    inner = geo.addPlaneSurface([geo.addCurveLoop([line(0, 1), *shared, line(3, 0)])])
    around = [line(1, 4), line(4, 5), line(5, 6), line(6, 3), -shared[1], -shared[0]]
    flats, own, air = [(2, inner), (2, geo.addPlaneSurface([geo.addCurveLoop(around)]))], [], []
    for k, (low, high) in enumerate(zip(heights, heights[1:])):
        grading = ([1, 1, 1], [0.1, 0.4, 1]) if k == 1 else ([4], [1])
        out = geo.extrude(flats, 0, 0, s * (high - low), numElements=grading[0], heights=grading[1])
        volumes = [i for i, (dimension, _) in enumerate(out) if dimension == 3]
        flats = [out[i - 1] for i in volumes]
        first, second = [out[i][1] for i in volumes]
        (own if k == 1 else air).append(first)
        air.append(second)
    geo.synchronize()
    return own, air


def core(d):
    """A yoke with a gap, in a ring of a coil region, upper half; the plane z = 0 is left natural, or named."""
    a, w = d.chance.uniform(0.05, 0.3), d.chance.uniform(0.2, 0.35)
    gap = a * d.chance.uniform(0.1, 0.4)
    yoke = d.box((-a, -w * a, 0), (a, w * a, a))
    window = d.box(((w - 1) * a, -w * a, 0), ((1 - w) * a, w * a, (1 - w) * a))
    iron = d.occ.cut([yoke], [window])[0][0]
    slit = d.box(((1 - w) * a, -w * a, 0), (a, w * a, gap / 2))
    iron = d.occ.cut([iron], [slit])[0][0]
    ring = d.box((-1.15 * a, -(w + 0.15) * a, 0.1 * a), (-(1 - w - 0.15) * a, (w + 0.15) * a, 0.3 * a))
    hole = d.box((-1.05 * a, -(w + 0.05) * a, 0.1 * a), (-(1 - w - 0.05) * a, (w + 0.05) * a, 0.3 * a))
    coil = d.occ.cut([ring], [hole])[0][0]
    far = d.chance.uniform(2.5, 5) * a
    (own, winding), air = d.fragment(d.box((-far, -far, 0), (far, far, far)), [iron, coil])
    for name, tags in (("iron", own), ("coil", winding), ("air", air)):
        d.region(name, tags)
    d.surfaces(z_min=(2, 0))
    natural = d.chance.random() < 0.5
    d.text = (
        '[analysis]\nfrequency = 0\nelements = "edge"\n[materials.m]\nrelative_permeability = 1000\n'
        '[regions.iron]\nmaterial = "m"\n[[coils]]\nname = "coil"\nregion = "coil"\nampere_turns = 100\n'
        f'center = [{-a * (1 - w / 2)}, 0, {0.2 * a}]\naxis = "z"\n[boundaries]\nflux_parallel = ["outer"]\n'
        + ("" if natural else 'flux_normal = ["z_min"]\n')
    )
    return far / 4, a / d.chance.uniform(4, 7), [own, winding]


def pole(d):
    """A round pole over a round coil in a quarter or a whole of a ball."""
    quarter = d.chance.choice([True, False])
    angle = 1.5707963267948966 if quarter else 6.283185307179586
    r = d.chance.uniform(0.01, 0.06)
    far = r * d.chance.uniform(5, 9)
    bodies = [d.cylinder((0, 0, 0.4 * r), 2 * r, r, angle), d.cylinder((0, 0, 0), 0.2 * r, 0.5 * r, angle)]
    (own, target), air = d.fragment(d.ball(far, angle, 0.0), bodies)
    for name, tags in (("pole", own), ("target", target), ("air", air)):
        d.region(name, tags)
    planes = {"x_min": (0, 0), "y_min": (1, 0)} if quarter else {}
    d.surfaces(z_min=(2, 0), **planes)
    names = ", ".join(f'"{name}"' for name in [*planes, "outer"])
    d.text = (
        '[analysis]\nfrequency = 0\n[materials.m]\nrelative_permeability = 500\n[regions.pole]\nmaterial = "m"\n'
        + COIL.format(center=f"0, 0, {1.5 * r}", radius=1.3 * r, width=0.5 * r, height=r)
        + f'[boundaries]\nflux_parallel = [{names}]\nflux_normal = ["z_min"]\n'
    )
    return far / 3.5, r / d.chance.uniform(2, 4), [own, target]


def sphere(d):
    """A conducting ball, or the void that a perfect conductor leaves, in an applied field."""
    r = d.chance.uniform(0.005, 0.5)
    far = r * d.chance.uniform(2, 4)
    whole = d.box((-far,) * 3, (far,) * 3) if d.chance.random() < 0.5 else d.ball(far)
    void = d.chance.random() < 0.5
    if void:
        air = [tag for _, tag in d.occ.cut([whole], [d.ball(r)])[0]]
        d.occ.synchronize()
    else:
        (own,), air = d.fragment(whole, [d.ball(r)])
        d.region("ball", own)
    d.region("air", air)
    faces = d.faces()
    inner = [t for t, b in faces.items() if max(abs(c) for c in b) < 1.2 * r]
    gmsh.model.addPhysicalGroup(2, [t for t in faces if t not in inner], name="outer")
    conditions = '[boundaries.uniform_field]\nsurfaces = ["outer"]\nb = [0, 0, 1]\n'
    if void:
        gmsh.model.addPhysicalGroup(2, inner, name="wall")
        conditions = '[boundaries]\nflux_parallel = ["wall"]\n' + conditions
        d.text = "[analysis]\nfrequency = 0\n" + conditions
    else:
        d.text = (
            '[analysis]\nfrequency = 1\n[materials.m]\nconductivity = 1e4\n[regions.ball]\nmaterial = "m"\n' + conditions
        )
    return far / 3, r / d.chance.uniform(2, 4), [air] if void else [own]


def tank(d):
    """A tank with a step in its wall, a bar inside and a round coil: an outside that is not convex."""
    a = d.chance.uniform(0.2, 1.5)
    step = d.chance.uniform(0.3, 0.6)
    whole = d.occ.cut([d.box((-a, -a, -a), (a, a, a))], [d.box((a * (1 - step), -a, a * (1 - step)), (a, a, a))])[0][0]
    bar = d.box((-0.6 * a, -0.1 * a, 0.2 * a), (-0.4 * a, 0.1 * a, 0.5 * a))
    (own,), air = d.fragment(whole, [bar])
    d.region("bar", own)
    d.region("oil", air)
    d.surfaces()
    d.text = (
        '[analysis]\nfrequency = 50\n[materials.m]\nconductivity = 1e4\n[regions.bar]\nmaterial = "m"\n'
        + COIL.format(center=f"0, 0, {-0.4 * a}", radius=0.3 * a, width=0.1 * a, height=0.1 * a)
        + '[boundaries]\nflux_parallel = ["outer"]\n'
    )
    return a / 3, a / d.chance.uniform(12, 18), [own]


def main():
    directory, count = Path(sys.argv[1]), int((sys.argv[2:] or ["40"])[0])
    directory.mkdir(parents=True, exist_ok=True)
    gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("General.Verbosity", 1)
    for kind in (plate, core, pole, sphere, tank):
        for k in range(count):
            device = Device(f"{kind.__name__}_{k:02}", random.Random(f"{kind.__name__} {k}"))
            cell, fine, regions = kind(device)
            device.write(directory, cell, fine, regions)
    gmsh.finalize()


if __name__ == "__main__":
    main()
