"""Scenes of tests/mitsuba as Mitsuba 3 knows them."""

import glob
import json
import math
import os

import numpy as np


def variant(name=None):
    """Chooses a variant of Mitsuba (LLVM if it can be had, else scalar) and returns the module."""
    for pattern in ["/usr/lib/*/libLLVM*.so*", "/usr/lib/llvm*/lib/libLLVM*.so*"]:
        for library in sorted(glob.glob(pattern), reverse=True):
            os.environ.setdefault("DRJIT_LIBLLVM_PATH", library)
    import mitsuba as mi

    for candidate in [name] if name else ["llvm_ad_rgb", "scalar_rgb"]:
        try:
            mi.set_variant(candidate)
            import drjit as dr

            if candidate.startswith("llvm"):
                dr.eval(dr.arange(mi.Float, 4) + 1)
            return mi
        except Exception as error:  # what a missing LLVM raises differs from version to version
            problem = error
    raise SystemExit(f"no variant of Mitsuba works: {problem}")


def rgb(values):
    return {"type": "rgb", "value": [float(x) for x in values]}


def bsdf(stuff):
    """Widths of GGX are squares of roughness; metals and diffuse bases are seen from both sides, as lanecast's are."""
    kind = stuff["type"]
    facets = {"distribution": "ggx", "alpha": stuff.get("roughness", 0) ** 2}
    rough = stuff.get("roughness", 0) > 0
    if kind == "matte":
        return {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": rgb(stuff["reflectance"])}}
    if kind == "conductor":
        metal = {"eta": rgb(stuff["eta"]), "k": rgb(stuff["k"])}
        metal.update({"type": "roughconductor", **facets} if rough else {"type": "conductor"})
        return {"type": "twosided", "bsdf": metal}
    if kind == "dielectric":
        glass = {"int_ior": stuff["ior"], "ext_ior": 1.0}
        glass.update({"type": "roughdielectric", **facets} if rough else {"type": "dielectric"})
        return glass
    if kind == "thin":
        return {"type": "thindielectric", "int_ior": stuff["ior"], "ext_ior": 1.0}
    if kind == "plastic":
        coat = {"type": "plastic", "int_ior": stuff["ior"], "ext_ior": 1.0, "nonlinear": True}
        return {"type": "twosided", "bsdf": {**coat, "diffuse_reflectance": rgb(stuff["reflectance"])}}
    if kind == "lamp":
        return {"type": "diffuse", "reflectance": rgb([0, 0, 0])}
    raise SystemExit(f"unknown material type {kind}")


def box(brick):
    """The six sides, wound so that their normals point out."""
    angle = math.radians(brick["turn"])
    turn = np.array([[math.cos(angle), 0, math.sin(angle)], [0, 1, 0], [-math.sin(angle), 0, math.cos(angle)]])
    quads = []
    for axis in range(3):
        for sign in [-1.0, 1.0]:
            a, b = np.zeros(3), np.zeros(3)
            a[(axis + 1) % 3], b[(axis + 2) % 3] = 1, 1
            normal = np.zeros(3)
            normal[axis] = sign
            if sign < 0:
                a, b = b, a
            corners = [normal - a - b, normal + a - b, normal + a + b, normal - a + b]
            quads.append([turn @ (c * np.array(brick["half"])) + np.array(brick["centre"]) for c in corners])
    return quads


def mesh(mi, name, quads, props):
    """Two triangles per quadrilateral."""
    shape = mi.Mesh(name, 4 * len(quads), 2 * len(quads), props=props)
    params = mi.traverse(shape)
    faces = [[4 * i, 4 * i + a, 4 * i + a + 1] for i in range(len(quads)) for a in (1, 2)]
    params["vertex_positions"] = np.asarray(quads, dtype=np.float32).ravel()
    params["faces"] = np.asarray(faces, dtype=np.uint32).ravel()
    params.update()
    return shape


def load(mi, file, size, spp):
    """The scene in `file`, and its integrator."""
    with open(file, encoding="utf-8") as text:
        scene = json.load(text)
    eye = scene["camera"]
    look = mi.ScalarTransform4f().look_at(origin=eye["eye"], target=eye["look_at"], up=eye["up"])
    film = {"type": "hdrfilm", "width": size, "height": size, "pixel_format": "rgb", "component_format": "float32"}
    sensor = {
        "type": "perspective",
        "fov": eye["fov"],
        "fov_axis": "y",
        "to_world": look,
        "near_clip": 0.01,
        "far_clip": 10000.0,
        "film": {**film, "rfilter": {"type": "box"}},
        "sampler": {"type": "independent", "sample_count": spp},
    }
    # A path of N scatterings has N + 1 edges after the camera's.
    integrator = {"type": "path", "max_depth": scene["depth"] + 1}
    parts = {"type": "scene", "sensor": sensor, "integrator": integrator}
    if any(scene["environment"]):
        parts["sky"] = {"type": "constant", "radiance": rgb(scene["environment"])}
    for i, item in enumerate(scene["objects"]):
        stuff = scene["materials"][item["material"]]
        quads = item.get("quads", []) + (box(item["box"]) if "box" in item else [])
        emitter = {"type": "area", "radiance": rgb(stuff["radiance"])} if stuff["type"] == "lamp" else None
        if quads:
            props = mi.Properties()
            props["bsdf"] = mi.load_dict(bsdf(stuff))
            if emitter:
                props["emitter"] = mi.load_dict(emitter)
            parts[f"mesh_{i}"] = mesh(mi, f"mesh_{i}", quads, props)
        if "sphere" in item:
            ball = item["sphere"]
            shape = {"type": "sphere", "center": ball["centre"], "radius": ball["radius"], "bsdf": bsdf(stuff)}
            if emitter:
                shape["emitter"] = emitter
            parts[f"sphere_{i}"] = shape
    return mi.load_dict(parts)


def render(mi, scene, spp, seed):
    """A picture as an array of rows, columns and colours."""
    return np.array(mi.render(scene, spp=spp, seed=seed), dtype=np.float64)
