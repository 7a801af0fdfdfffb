"""Design 2: nothing under core knows Blender, one module knows the GPU, and imports go upwards only."""

import ast
import subprocess
import sys
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
ADDON = REPOSITORY / "addon"

# Rooms from the bottom up, as design.md lists them; rooms of one floor stand in one string.
FLOORS = (
    "core.scene core.status core.antialiasing core.environment_cube core.expressions core.strips core.bvh_nodes "
    "core.clear_cells core.empty_space",
    "core.models core.tableaus core.rosenbrock core.nystrom core.dop853 core.settings core.bvh core.textures",
    "core.frame core.compose core.observers core.aim",
    "core.device",
    "core.pipelines",
    "core.memory",
    "core.trace",
    "core.report core.reference",
    "export image",
    "properties",
    "operators engine commands",
    "panels",
)
FLOOR_OF = {room: floor for floor, rooms in enumerate(FLOORS) for room in rooms.split()}


def module_name(path):
    """ "core.models.base" for addon/core/models/base.py."""
    parts = path.relative_to(ADDON).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_name(path): path for path in sorted(ADDON.rglob("*.py"))}


def statements(tree):
    """All statements but those under `if TYPE_CHECKING:`, which are never run."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            continue
        yield node
        yield from statements(node)


def imports(name, only_at_import=False):
    """(modules of addon, names of foreign packages) that a module imports anywhere, or just while it is imported."""
    path = MODULES[name]
    package = name.split(".") if path.name == "__init__.py" else name.split(".")[:-1]
    package = [part for part in package if part]
    own, foreign = set(), set()
    tree = ast.parse(path.read_text(encoding="utf-8"))
    if only_at_import:
        for function in [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]:
            function.body = []
    for node in statements(tree):
        if isinstance(node, ast.Import):
            foreign |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            foreign.add(node.module.split(".")[0])
        elif isinstance(node, ast.ImportFrom):
            if node.level - 1 > len(package):
                continue  # the extension's own package, outside addon
            base = [*package[: len(package) - node.level + 1], *(node.module or "").split(".")]
            base = ".".join(part for part in base if part)
            for alias in node.names:
                inner = f"{base}.{alias.name}".strip(".")
                own.add(inner if inner in MODULES else base)
    return own - {name, ""}, foreign


def room_of(name):
    """The longest listed room that a module is in; None where it is in none."""
    parts = name.split(".")
    names = [".".join(parts[:length]) for length in range(len(parts), 0, -1)]
    return next((room for room in names if room in FLOOR_OF), None)


def test_the_scan_sees_known_imports():
    own, foreign = imports("core.trace")
    assert {"core.device", "core.pipelines.paper", "core.scene"} <= own and "numpy" in foreign
    of_a_model = {"core.models.base", "core.models.borders", "core.models.parameter"}
    assert imports("core.models.schwarzschild")[0] == of_a_model
    assert "moderngl" in imports("core.device")[1]


def test_every_room_of_core_is_listed():
    rooms = {name for name in MODULES if name.startswith("core.") and name.count(".") == 1}
    assert rooms <= set(FLOOR_OF), "a new room of core: give it a floor in this test and in design.md"


@pytest.mark.parametrize("name", [name for name in MODULES if room_of(name)])
def test_imports_go_upwards_only(name):
    room = room_of(name)
    for other in imports(name)[0]:
        below = room_of(other)
        if below and below != room:
            assert FLOOR_OF[below] <= FLOOR_OF[room], f"{name} imports {other}, which is on a floor above it"


def test_no_circle_of_imports():
    """A package's __init__ stands for its whole folder, and so may be imported by its own modules."""
    graph = {name: {other for other in imports(name, only_at_import=True)[0] if other != name} for name in MODULES}
    graph = {
        name: {other for other in others if not name.startswith(f"{other}.") and other != ""}
        for name, others in graph.items()
    }
    TopologicalSorter(graph).prepare()  # raises CycleError


@pytest.mark.parametrize("name", [name for name in MODULES if name.startswith("core")])
def test_core_knows_neither_blender_nor_its_users(name):
    own, foreign = imports(name)
    assert not foreign & {"bpy", "bmesh", "mathutils", "gpu", "bl_math", "blf"}
    assert all(other.startswith("core") for other in own)


def test_one_module_knows_the_gpu():
    users = {name for name in MODULES if {"moderngl", "glcontext"} & imports(name)[1]}
    assert users == {"core.device"}


def test_core_imports_without_blender_and_without_opengl():
    """In a process of its own, where importing either fails, as it does on a machine that has neither."""
    program = """
import sys
for name in ("bpy", "mathutils", "moderngl", "glcontext", "OpenEXR"):
    sys.modules[name] = None
import importlib, pkgutil
import addon.core
for module in pkgutil.walk_packages(addon.core.__path__, "addon.core."):
    importlib.import_module(module.name)
print("imported")
"""
    done = subprocess.run([sys.executable, "-c", program], cwd=REPOSITORY, capture_output=True, text=True, timeout=120)
    assert done.stdout.strip() == "imported", done.stderr
