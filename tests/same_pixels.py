"""Hash what the renderer draws by every choice of every setting, to show that a change moves no pixel.

    python -m tests.same_pixels hash before.json      # on the one commit
    python -m tests.same_pixels hash after.json       # on the other one, on the same driver
    python -m tests.same_pixels compare before.json after.json

Each of five scenes is drawn at 160x120: by default and by every choice of every setting, the picture by
itself and all other outputs together. Settings and outputs that were renamed in between are found by the
tables below.
"""

import argparse
import hashlib
import json
import sys
import warnings
from pathlib import Path

from firefly_sample import Renderer
from firefly_sample.errors import FireflyError
from firefly_sample.frame import OUTPUTS
from firefly_sample.scenes import build_scene, find_scene
from firefly_sample.settings import CHOICES, PRESETS, Settings

RENAMED = {
    "position": "position_method",
    "normals": "normal_format",
    "albedo": "albedo_format",
    "accumulation": "accumulation_format",
    "lights": "light_method",
    "window": "range_falloff",
    "specular": "specular_model",
    "particle_slices": "particle_order_depths",
    "volume_shadows": "particle_shadows",
    **{f"volume_{part}": f"particle_shadow_{part}" for part in ("slices", "tile", "format", "reads")},
    "volume_interpolation": "particle_shadow_interpolation",
}
"""Old and new names of settings."""
RENAMED_OUTPUTS = {"volume_atlas": "particle_shadow_atlas"}

SIZE = 160, 120
TIME = 1.25
SCENES = {
    "forest": ("forest", {}),
    "forest --mist": ("forest", {"mist": True}),
    "lightbulbs --sun": ("lightbulbs", {"sun": True}),
    "smoke": ("smoke", {}),
    "spheres": ("spheres", {}),
}
NUMBERS = {
    "cutoff_budget": (0.0, 1e-2),
    "cutoff_threshold": (1e-2,),
    "exposure": (0.5,),
    "particle_order_depths": (16,),
    "particle_shadow_reads": (4,),
    "particle_shadow_slices": (8,),
    "particle_shadow_tile": (16,),
    "shadow_atlas": (512,),
    "shadow_resolution": (64,),
}
"""Values of the settings that are numbers."""
TOGETHER = {
    "particle_shadow_reads": {"particle_shadows": "loop"},
    "particle_shadow_format": {"particle_shadows": "blend"},
    "volume_proxy": {"light_method": "volumes"},
    "volume_depth_test": {"light_method": "volumes"},
    "range_falloff": {"light_method": "volumes"},
}
"""What is set beside a setting, where that shows only so."""
METHODS = "volumes", "clustered", "fullscreen", "loop", "forward"


def names_here():
    """Settings of this commit by the name that they have after all renaming."""
    return {RENAMED.get(name, name): name for name in Settings.__dataclass_fields__}


def variations():
    """Names and changes of the settings: the defaults, presets, and one setting after the other."""
    here = names_here()
    yield "default", {}
    for name in PRESETS:
        yield f"preset={name}", dict(PRESETS[name])
    for new, name in sorted(here.items()):
        if name in CHOICES or new in NUMBERS:
            beside = {here[other]: value for other, value in TOGETHER.get(new, {}).items()}
            for choice in CHOICES.get(name, ()) + NUMBERS.get(new, ()):
                yield f"{new}={choice}", beside | {name: choice}
    for method in METHODS:
        yield f"classic {method}", {"look": "classic", here["light_method"]: method}
        for light_resolution in ("full", "half"):
            for position in CHOICES[here["position_method"]]:
                changes = {here["position_method"]: position, here["light_method"]: method}
                changes["light_resolution"] = light_resolution
                yield f"{method} {light_resolution} {position}", changes


def digest(image):
    """Hash of an image's shape, dtype and bytes."""
    return hashlib.sha256(f"{image.shape} {image.dtype}".encode() + image.tobytes()).hexdigest()[:24]


def hashes(scene_name, pick):
    """Hash of each output by each variation of one scene."""
    plugin, parameters = SCENES[scene_name]
    scene = build_scene(find_scene(plugin), **parameters)
    new_outputs = {RENAMED_OUTPUTS.get(name, name): name for name in OUTPUTS}
    found = {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with Renderer(SIZE) as renderer:
            for name, changes in variations():
                if pick and pick not in name:
                    continue
                sets = (["color"], [new for new in sorted(new_outputs) if new != "color"])
                for outputs in sets:
                    for wanted in (outputs, ["radiance"] if len(outputs) > 1 else []):
                        if not wanted:
                            continue
                        try:
                            renderer.settings = Settings().with_changes(**changes)
                            frame = renderer.render(scene, TIME, [new_outputs[new] for new in wanted])
                        except FireflyError as error:
                            found[f"{scene_name} | {name} | {'+'.join(wanted)[:20]}"] = type(error).__name__
                            continue
                        for new in wanted:
                            key = f"{scene_name} | {name} | {new}" + (" alone" if len(wanted) == 1 else "")
                            found[key] = digest(frame[new_outputs[new]])
                print(f"\r{scene_name}: {name}{' ' * 20}", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    return found


def main(arguments=None):
    """Run one of the two commands; the exit code is 1 where tables differ."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = parser.add_subparsers(dest="command", required=True)
    hashing = commands.add_parser("hash")
    hashing.add_argument("file", type=Path)
    hashing.add_argument("--pick", default="", help="only variations whose name has this in it")
    hashing.add_argument("--scene", action="append", choices=SCENES, help="only this scene")
    comparing = commands.add_parser("compare")
    comparing.add_argument("files", nargs=2, type=Path)
    given = parser.parse_args(arguments)
    if given.command == "hash":
        table = {}
        for scene_name in given.scene or SCENES:
            table |= hashes(scene_name, given.pick)
        given.file.write_text(json.dumps(table, indent=1, sort_keys=True), encoding="utf-8")
        print(len(table), hashlib.sha256(given.file.read_bytes()).hexdigest())
        return 0
    before, after = (json.loads(file.read_text(encoding="utf-8")) for file in given.files)
    different = sorted(key for key in before.keys() & after.keys() if before[key] != after[key])
    for key in different:
        print("different:", key)
    only = [sorted(before.keys() - after.keys()), sorted(after.keys() - before.keys())]
    for where, keys in zip(given.files, only, strict=True):
        for key in keys:
            print(f"only in {where.name}:", key)
    print(f"{len(before.keys() & after.keys()) - len(different)} hashes are equal, {len(different)} are not")
    return 1 if different or any(only) else 0


if __name__ == "__main__":
    sys.exit(main())
