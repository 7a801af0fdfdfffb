"""GLSL functions as numpy functions: glsl() runs an expression of chosen shader files on arrays."""

import math

import numpy as np
import pytest

from addon.core import device as gpu
from addon.core.compose import Choice, Source, compose

COLUMNS = 256

MAIN = """
#line 1 {number}
{samplers}
{outputs}
void main() {{
    ivec2 at = ivec2(gl_FragCoord.xy);
    {fetches}
    {body}
}}
"""


def evaluate(files, body, inputs, outputs=("result",), uniforms=None, textures=None, flags=(), generated=()):
    """Run `body` once for each row of the inputs, through addon.core.compose and addon.core.device.

    files    : shader files whose functions the body calls
    body     : GLSL; inputs are vec4 variables by their names, results are assigned to out_<output>
    inputs   : name -> (n, 1 to 4); missing components are 0
    textures : sampler name -> float32, (rows, columns, 4), as addon.core.textures packs them, or a volume,
               (depth, rows, columns, 1)
    generated : (name, GLSL) of printed functions
    returns  : output name -> float32, (n, 4)
    """
    n = len(next(iter(inputs.values())))
    rows = math.ceil(n / COLUMNS)
    padded = {}
    for name, values in inputs.items():
        values = np.asarray(values, np.float32).reshape(n, -1)
        padded[name] = np.zeros((rows * COLUMNS, 4), np.float32)
        padded[name][:n, : values.shape[1]] = values
    chosen = compose(Choice(files[0], tuple(files[1:]), frozenset(flags), tuple(generated)))
    text = chosen.text + MAIN.format(
        number=len(chosen.files),
        samplers="\n".join(f"uniform sampler2D given_{name};" for name in inputs),
        outputs="\n".join(f"out vec4 out_{name};" for name in outputs),
        fetches="\n    ".join(f"vec4 {name} = texelFetch(given_{name}, at, 0);" for name in inputs),
        body=body,
    )
    source = Source(text, (*chosen.files, "the test's main"), tuple(f"out_{name}" for name in outputs))

    def job(device):
        size = (COLUMNS, rows)
        given = {
            f"given_{name}": device.texture(size, values.reshape(rows, COLUMNS, 4)) for name, values in padded.items()
        }
        for name, values in (textures or {}).items():
            volume = values.ndim == 4
            given[name] = device.volume(values) if volume else device.texture(values.shape[1::-1], values)
        results = {name: device.texture(size) for name in outputs}
        target = device.target(results)
        target.begin(size)
        program = gpu.Program(device.ctx, source, device._vertex_text)
        program.draw(target, given, {"u_quad_depth": 0.5} | (uniforms or {}))
        return {name: gpu.read(texture, *size).reshape(-1, 4)[:n] for name, texture in results.items()}

    return gpu.run(job)


@pytest.fixture
def glsl(egl):
    """evaluate(), where there is a device."""
    return evaluate


@pytest.fixture(scope="session", autouse=True)
def device_released():
    """The context goes before the interpreter does."""
    yield
    gpu.shutdown()
