"""The GPU. The only module that knows moderngl.

One worker thread owns the context and every GL object: Blender's own context is always current on its main thread, and
a second one made there draws into Blender's without a word. Everybody hands jobs to run().
"""

from __future__ import annotations

import ctypes
import gc
import sys
import threading
import time
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

import numpy as np

from .compose import SHADERS, Choice, ShaderError, Source, compose

Result = TypeVar("Result")
POLL_SECONDS = 0.05
NUMPY_KINDS = {"f2": np.float16, "f4": np.float32, "u1": np.uint8, "u4": np.uint32}  # of the arrays that are uploaded
BYTES = {"f1": 1, "f2": 2, "f4": 4, "u1": 1, "u4": 4}


class DeviceError(RuntimeError):
    """There is no usable OpenGL 3.3 device, or it failed; the message says what to install or to change."""


class Device:
    """The context and what is made in it. Only used by jobs, in the worker thread."""

    def __init__(self):
        self.ctx = _create_context()
        self.ctx.gc_mode = "context_gc"  # objects that Python forgets are released here, not in a foreign thread
        self.name = self.ctx.info["GL_RENDERER"]
        self.texture_limit = self.ctx.info["GL_MAX_TEXTURE_SIZE"]
        self.compile_milliseconds = 0.0
        self._programs: dict[Choice, Program] = {}
        self.tile_sizes: dict[Choice, tuple[int, int]] = {}  # columns and rows that a draw with a program had time for
        self._vertex_text = VERTEX_VERSION + (SHADERS / "passes" / "quad.vert").read_text(encoding="utf-8")
        self.ctx.enable_direct(0x884F)  # GL_TEXTURE_CUBE_MAP_SEAMLESS: no seams between the sky's faces

    def program(self, choice: Choice) -> Program:
        """The compiled program of a choice; compiled once."""
        if choice not in self._programs:
            begin = time.perf_counter()
            self._programs[choice] = Program(self.ctx, compose(choice), self._vertex_text)
            self.compile_milliseconds += 1e3 * (time.perf_counter() - begin)
        return self._programs[choice]

    @property
    def program_count(self) -> int:
        return len(self._programs)

    def texture(self, size: tuple[int, int], data: np.ndarray | None = None, dtype: str = "f4", components: int = 4):
        """A texture read with texelFetch. size : columns, rows; data : (rows, columns, components)."""
        if max(size) > self.texture_limit:
            raise DeviceError(
                f"A texture of {size[0]} x {size[1]} is needed, but '{self.name}' allows {self.texture_limit}. "
                "Use fewer triangles or smaller images."
            )
        content = None if data is None else np.ascontiguousarray(data, NUMPY_KINDS[dtype])
        texture = self.ctx.texture(size, components, content, dtype=dtype)
        texture.filter = (self.ctx.NEAREST, self.ctx.NEAREST)
        return texture

    def cube(self, faces: np.ndarray, mipmaps: bool = False):
        """A cube texture, filtered. faces : float32, (6, size, size, 3); mipmaps : for textureLod, a third more."""
        size = faces.shape[1]
        cube = self.ctx.texture_cube((size, size), 3, np.ascontiguousarray(faces, np.float32), dtype="f4")
        if mipmaps:
            cube.build_mipmaps()
        cube.filter = (self.ctx.LINEAR_MIPMAP_LINEAR if mipmaps else self.ctx.LINEAR, self.ctx.LINEAR)
        return cube

    def volume(self, data: np.ndarray, dtype: str = "f4"):
        """A 3D texture for texelFetch. data : (depth, rows, columns, channels)."""
        depth, rows, columns, channels = data.shape
        content = np.ascontiguousarray(data, NUMPY_KINDS[dtype])
        volume = self.ctx.texture3d((columns, rows, depth), channels, content, alignment=1, dtype=dtype)
        volume.filter = (self.ctx.NEAREST, self.ctx.NEAREST)
        return volume

    def depth_buffer(self, size: tuple[int, int]):
        return self.ctx.depth_renderbuffer(size)

    def target(self, textures: Mapping[str, object], depth=None) -> Target:
        """A place to draw to. textures : name -> texture; a program writes out_<name>, in the same order."""
        return Target(self.ctx, textures, depth)

    def any_drawn(self):
        """A query: `with query: draw`, then query.samples is 0 where the early z test stopped every fragment."""
        return self.ctx.query(samples=True)

    def finish(self) -> None:
        self.ctx.finish()

    def check(self) -> None:
        """Raise what OpenGL has to say: moderngl never does."""
        error = self.ctx.error
        if error != "GL_NO_ERROR":
            hint = "Lower the resolution or the number of triangles." if "MEMORY" in error else "Please report this."
            raise DeviceError(f"'{self.name}' answered {error}. {hint}")


VERTEX_VERSION = "#version 330 core\n"


class Program:
    """A fragment program on a triangle that fills the viewport."""

    def __init__(self, ctx, source: Source, vertex_text: str):
        self.outputs = source.outputs
        try:
            self._program = ctx.program(
                vertex_shader=vertex_text,
                fragment_shader=source.text,
                fragment_outputs={name: index for index, name in enumerate(source.outputs)},
            )
        except Exception as error:  # moderngl raises its own Error with the driver's log
            raise ShaderError(f"The driver rejects a shader:\n{source.explain(str(error))}") from error
        self._vertices = ctx.vertex_array(self._program, [])

    def uses(self, name: str) -> bool:
        """Whether a uniform or sampler is left in the program."""
        return name in self._program

    def set(self, uniforms: Mapping[str, object]) -> None:
        """Give values; names that the program does not use are passed over, since drivers drop unused uniforms."""
        for name, value in uniforms.items():
            if name in self._program:
                self._program[name].value = value

    def draw(self, target: Target, textures: Mapping[str, object], uniforms: Mapping[str, object]) -> None:
        """One viewport-filling quad. textures : sampler name -> texture."""
        if self.outputs != target.outputs:
            raise ShaderError(f"A program writes {self.outputs}, but its target takes {target.outputs}.")
        unit = 0
        for name, texture in textures.items():
            if name in self._program:
                texture.use(unit)
                self._program[name].value = unit
                unit += 1
        self.set(uniforms)
        target.framebuffer.use()
        self._vertices.render(vertices=3)


class Target:
    """Where a pass draws: textures in the order of the program's outputs, and the depth buffer it is tested against."""

    def __init__(self, ctx, textures: Mapping[str, object], depth=None):
        self._ctx = ctx
        self.outputs = tuple(f"out_{name}" for name in textures)
        self.framebuffer = ctx.framebuffer(color_attachments=list(textures.values()), depth_attachment=depth)
        self._tested = depth is not None

    def begin(self, viewport: tuple[int, int], write_depth: bool = False) -> None:
        """Set what the next draw needs. viewport : columns, rows, from the lower left corner."""
        self.framebuffer.viewport = (0, 0, *viewport)
        self.framebuffer.depth_mask = write_depth
        if self._tested:
            self._ctx.enable_only(self._ctx.DEPTH_TEST)
            self._ctx.depth_func = "<"
        else:
            self._ctx.enable_only(self._ctx.NOTHING)

    def clear(self, *color: float, depth: float = 1.0) -> None:
        self.framebuffer.depth_mask = True
        self.framebuffer.clear(*color, depth=depth)

    def read(self, index: int, columns: int, rows: int) -> np.ndarray:
        """The lower left part of the index-th texture as float32, (rows, columns, 4); row 0 is the bottom."""
        content = self.framebuffer.read((0, 0, columns, rows), components=4, attachment=index, dtype="f4", alignment=1)
        return np.frombuffer(content, np.float32).reshape(rows, columns, 4)


def read(texture, columns: int, rows: int) -> np.ndarray:
    """A texture's lower left part as float32, (rows, columns, components); row 0 is the bottom."""
    kind = np.float16 if texture.dtype == "f2" else np.float32
    pixels = np.frombuffer(texture.read(), kind).reshape(texture.height, texture.width, texture.components)
    return pixels[:rows, :columns].astype(np.float32)


def _create_context():
    """A context of our own on this thread, and proof that it is."""
    import moderngl

    try:
        if sys.platform.startswith("linux"):
            before = _current_egl_context()
            ctx = moderngl.create_context(
                standalone=True, require=330, backend="egl", libegl="libEGL.so.1", libgl="libGL.so.1"
            )
            if before or not _current_egl_context():
                raise DeviceError(
                    "The OpenGL context of Nonlinear Rays is not its own (another one is current on its thread). "
                    "Restart Blender and report this."
                )
            return ctx
        return moderngl.create_context(standalone=True, require=330)
    except DeviceError:
        raise
    except Exception as error:  # glcontext and moderngl raise several kinds
        raise DeviceError(
            f"No OpenGL 3.3 device: {error}. On Debian or Ubuntu: apt install libegl1 libgl1 libgl1-mesa-dri libgles2; "
            "elsewhere, install your graphics card's driver."
        ) from error


def _current_egl_context() -> int:
    """The EGL context that is current on this thread; 0 for none."""
    egl = ctypes.CDLL("libEGL.so.1")
    egl.eglGetCurrentContext.restype = ctypes.c_void_p
    return egl.eglGetCurrentContext() or 0


_lock = threading.Lock()
_worker: ThreadPoolExecutor | None = None
_device: Device | None = None


def _work(job: Callable[[Device], Result]) -> Result:
    """Runs in the worker thread."""
    global _device
    if _device is None:
        _device = Device()
    try:
        result = job(_device)
        _device.check()
        return result
    finally:
        gc.collect(0)
        _device.ctx.gc()
        while _device.ctx.error != "GL_NO_ERROR":  # releasing a bound framebuffer leaves a stale one
            pass


def run(job: Callable[[Device], Result], poll: Callable[[], None] | None = None) -> Result:
    """Run job(device) in the GPU's thread and wait. poll() is called in the calling thread every POLL_SECONDS; what it
    raises is raised here at once (the job has to notice by itself that it is to stop).
    """
    global _worker
    with _lock:
        if _worker is None:
            _worker = ThreadPoolExecutor(1, thread_name_prefix="nonlinear_rays")
        future: Future = _worker.submit(_work, job)
    while poll is not None and not _done(future):
        poll()
    return future.result()


def _done(future: Future) -> bool:
    try:
        future.exception(timeout=POLL_SECONDS)
        return True
    except TimeoutError:
        return False


def describe() -> str:
    """The renderer's name, for reports and preferences. Raises DeviceError."""
    return run(lambda device: device.name)


def shutdown() -> None:
    """Release everything; the next run() starts afresh."""
    global _worker, _device
    with _lock:
        worker, _worker = _worker, None
    if worker is None:
        return

    def release() -> None:
        global _device
        if _device is not None:
            _device.ctx.release()
            _device = None

    try:
        worker.submit(release).result()
    except RuntimeError:  # the interpreter is exiting and has ended the thread: the process takes the context along
        _device = None
    worker.shutdown()
