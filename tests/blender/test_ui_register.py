"""What registering leaves behind, and that unregistering takes it away again."""

import bpy
import pytest

from tools import bpy_extension

ENGINE = "NONLINEAR_RAYS"


def panels_for_engine():
    """Names of Blender's own panels that are shown for the engine."""
    panels = [panel for panel in bpy.types.Panel.__subclasses__() if panel.__module__.startswith("bl_ui")]
    return {panel.__name__ for panel in panels if ENGINE in getattr(panel, "COMPAT_ENGINES", ())}


def test_registering_twice_is_clean(extension):
    shown = panels_for_engine()
    assert shown
    bpy_extension.disable()
    try:
        assert not hasattr(bpy.types.Scene, "nonlinear_rays")
        assert not hasattr(bpy.types.Object, "nonlinear_rays")
        assert not hasattr(bpy.types.World, "nonlinear_rays")
        assert not any(name.startswith("NONLINEAR_RAYS") for name in dir(bpy.types))
        assert panels_for_engine() == set()
    finally:
        bpy_extension.enable()
    assert panels_for_engine() == shown
    assert bpy.context.scene.nonlinear_rays.scale == 1.0


def test_a_part_that_fails_to_register_takes_the_others_with_it(extension, monkeypatch):
    bpy_extension.disable()
    try:
        addon = extension("addon")
        monkeypatch.setattr(extension("addon.panels"), "register", lambda: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            addon.register()
        assert not hasattr(bpy.types.Scene, "nonlinear_rays")
        monkeypatch.undo()
    finally:
        bpy_extension.enable()


@pytest.mark.parametrize(
    "panel",
    [
        "DATA_PT_lens",
        "RENDER_PT_format",
        "RENDER_PT_output",
        "RENDER_PT_color_management",
        "EEVEE_MATERIAL_PT_context_material",
        "EEVEE_MATERIAL_PT_surface",
        "EEVEE_WORLD_PT_surface",
        "DATA_PT_EEVEE_light",
        "DATA_PT_spot",
    ],
)
def test_blenders_own_panels_are_shown(extension, panel):
    assert ENGINE in getattr(bpy.types, panel).COMPAT_ENGINES


@pytest.mark.parametrize(
    "panel", ["VIEWLAYER_PT_filter", "VIEWLAYER_PT_layer_passes", "DATA_PT_light", "RENDER_PT_gpencil"]
)
def test_panels_without_meaning_here_are_not_shown(extension, panel):
    cls = getattr(bpy.types, panel, None)
    assert cls is None or ENGINE not in cls.COMPAT_ENGINES


def test_every_property_says_what_it_is(extension):
    groups = [bpy.context.scene.nonlinear_rays]
    groups += [getattr(groups[0], name) for name in extension("addon.core.models").MODELS]
    for group in groups:
        for definition in group.bl_rna.properties:
            if definition.identifier in {"rna_type", "name"} or definition.type == "POINTER":
                continue
            assert definition.description, definition.identifier
            if definition.type in {"FLOAT", "INT"}:
                assert "Unit:" in definition.description, definition.identifier


def test_long_sentences_are_broken_between_words(extension):
    wrapped = extension("addon.panels").wrapped
    text = "'Suzanne': 3 of 968 triangles have no area and were skipped."
    lines = wrapped(text, 20)
    assert " ".join(lines) == text
    assert all(len(line) <= 20 for line in lines)


def test_the_add_menu_makes_an_analytic_sphere(empty_file):
    assert bpy.ops.nonlinear_rays.add_analytic_sphere(radius=2.0) == {"FINISHED"}
    sphere = bpy.context.object
    assert sphere.nonlinear_rays.analytic_sphere
    assert tuple(sphere.scale) == (2.0, 2.0, 2.0)
    assert max(vertex.co.length for vertex in sphere.data.vertices) == pytest.approx(1.0, abs=1e-5)
