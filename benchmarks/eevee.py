"""The shared passes against Blender's EEVEE on the same surfaces, camera and lamps, in one run.

    PYTHONPATH=. .venv/bin/python benchmarks/eevee.py --python /path/to/an/interpreter/with/bpy

`bpy`, Blender as a Python module (GPL, 350 MB), is no dependency: install it into an environment of
its own and name its interpreter here or as $BPY_PYTHON. Without it a line says that it was skipped.
Both draw the thesis's head-shot by software OpenGL twice, and the second time counts, when shaders
are compiled: CPU seconds, user and system, of all threads. EEVEE draws skin, eyes and clothes with
subsurface scattering, shadows and 4 samples a pixel, and no hair; ours is a frame's surfaces and
hair at 2x2, then light that comes through, then golubev's scattering and the picture.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

SIZE = (1920, 1080)
SAMPLES = (4, 1)


def blender(folder: Path) -> None:
    """Runs where bpy is: draws what lies in the folder, prints seconds as JSON."""
    import bpy
    from mathutils import Matrix

    told = json.loads((folder / "scene.json").read_text())
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    for k in range(told["meshes"]):
        with np.load(folder / f"{k}.npz") as stored:
            points, faces = stored["points"], stored["faces"]
        mesh = bpy.data.meshes.new(str(k))
        mesh.from_pydata((points / 1000).tolist(), [], faces.tolist())
        mesh.polygons.foreach_set("use_smooth", np.ones(len(faces), bool))
        made = bpy.data.materials.new(str(k))
        made.use_nodes = True
        principled = made.node_tree.nodes["Principled BSDF"].inputs
        principled["Base Color"].default_value = (0.5, 0.3, 0.22, 1.0)
        principled["Subsurface Weight"].default_value = 1.0
        principled["Subsurface Radius"].default_value = (1.0, 0.4, 0.2)
        principled["Subsurface Scale"].default_value = 0.003
        mesh.materials.append(made)
        scene.collection.objects.link(bpy.data.objects.new(str(k), mesh))
    for k, (place, irradiance, radius) in enumerate(told["lamps"]):
        light = bpy.data.lights.new(str(k), "SUN")
        light.energy, light.angle = irradiance, 2 * radius
        lamp = bpy.data.objects.new(str(k), light)
        lamp.matrix_world = Matrix(place)
        scene.collection.objects.link(lamp)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.sensor_fit, camera.data.angle = "VERTICAL", told["fov"]
    camera.data.clip_start, camera.data.clip_end = 0.01, 20.0
    camera.matrix_world = Matrix(told["camera"])
    scene.collection.objects.link(camera)
    scene.camera, scene.render.engine = camera, told["engine"]
    scene.render.resolution_x, scene.render.resolution_y = told["size"]
    scene.render.filepath = str(folder / "eevee.png")
    spent = {}
    for samples in told["samples"]:
        scene.eevee.taa_render_samples = samples
        for _ in range(2):
            start = time.process_time(), time.perf_counter()
            bpy.ops.render.render(write_still=True)
            spent[samples] = time.process_time() - start[0], time.perf_counter() - start[1]
    print("SPENT " + json.dumps([bpy.app.version_string, spent]))


def scene_of(folder: Path, size: tuple[int, int]) -> None:
    """Draw ours, print what it takes, and leave the scene in the folder."""
    import renderer
    from renderer import gl
    from renderer.scene.graph import look_at
    from stimuli import scenes

    table = scenes.merge(scenes.load_table("thesis"), {"camera": {"framing": "head-shot"}})
    scene = scenes.read_scene(table)
    golubev = renderer.make("golubev", {})
    with renderer.Renderer(scenes.stage(scene, 0).graph, size, 2) as drawing:
        print(f"{drawing.info()['gl_renderer']}, head-shot, {size[0]}x{size[1]}")
        drawn = [*drawing.surfaces.surfaces, *drawing.surfaces.eyes]
        for k, one in enumerate(drawn):
            part = one.item.primitive
            points = one.item.in_world(part.positions)
            np.savez(folder / f"{k}.npz", points=points, faces=part.faces)
        for _ in range(2):
            marks = [_now()]
            with drawing.frame() as frame:
                gl.finish()
                marks.append(_now())
                frame.transmitted(golubev.transmission)
                gl.finish()
                marks.append(_now())
                frame.render(golubev)
                marks.append(_now())
                view = frame.view
        lamps = [
            (look_at(light.towards, np.zeros(3)).tolist(), max(light.irradiance), light.radius_deg)
            for light in drawing.lights
        ]
    spent = np.diff(marks, axis=0)
    print(f"{'':<44}{'CPU s':>8}{'wall s':>8}")
    names = ("surfaces and hair, 2x2", "what comes through", "golubev's scattering, picture")
    for name, (cpu, wall) in zip(names, spent, strict=True):
        print(f"{'subdermal: ' + name:<44}{cpu:>8.2f}{wall:>8.2f}", flush=True)
    camera = np.linalg.inv(view.view)
    camera[:3, 3] /= 1000
    told = {
        "meshes": len(drawn),
        "lamps": [(place, power, np.radians(radius)) for place, power, radius in lamps],
        "camera": camera.tolist(),
        "fov": 2 * float(np.arctan(1 / view.projection[1, 1])),
        "size": size,
        "samples": SAMPLES,
        "engine": "BLENDER_EEVEE",
    }
    (folder / "scene.json").write_text(json.dumps(told))


def _now() -> tuple[float, float]:
    return time.process_time(), time.perf_counter()


def main() -> None:
    ask = argparse.ArgumentParser(description=__doc__)
    ask.add_argument("--python", default=os.environ.get("BPY_PYTHON", sys.executable))
    ask.add_argument("--size", default="x".join(map(str, SIZE)))
    ask.add_argument("--picture", type=Path, help="where EEVEE's picture is put, to be looked at")
    ask.add_argument("--blender", type=Path, help=argparse.SUPPRESS)
    options = ask.parse_args()
    if options.blender:
        blender(options.blender)
        return
    there = subprocess.run([options.python, "-c", "import bpy"], capture_output=True, text=True)
    if there.returncode:
        print(f"skipped: {options.python} has no bpy; see the head of benchmarks/eevee.py")
        return
    width, _, height = options.size.partition("x")
    with tempfile.TemporaryDirectory(prefix="subdermal-eevee-") as scratch:
        folder = Path(scratch)
        scene_of(folder, (int(width), int(height)))
        command = [options.python, __file__, "--blender", str(folder)]
        done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
        (line,) = (x for x in done.stdout.splitlines() if x.startswith("SPENT "))
        version, spent = json.loads(line.removeprefix("SPENT "))
        for samples, (cpu, wall) in spent.items():
            name = f"EEVEE of Blender {version}: samples {samples}"
            print(f"{name:<44}{cpu:>8.2f}{wall:>8.2f}")
        if options.picture:
            options.picture.write_bytes((folder / "eevee.png").read_bytes())


if __name__ == "__main__":
    main()
