"""The scene drawn offscreen: the whole of it once for each camera that stands still, then only the part with the arm in it."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from copy import copy
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from vgtsim.arrays import Array
from vgtsim.description import Tank
from vgtsim.graphics import explain_no_picture, mujoco
from vgtsim.kinematics import find_axis, trace_line
from vgtsim.mjcf import build_model, build_spec, finish_model, lower_waste, names, show_pit, show_things, tank
from vgtsim.output.readings import name_things
from vgtsim.output.replay import make_replay, pose_model, project
from vgtsim.site import Site

Picture = NDArray[np.uint8]
Box = tuple[int, int, int, int]  # left, top, right and bottom, pixels

_DIM = 0.45  # of the liner: members without force are a light grey
_GHOST = (0.75, 0.80, 0.86, 0.10)  # the near wall from outside: there, but not in the way
_HOSE, _PIECES = (0.25, 0.42, 0.30, 1.0), 4  # dark green, between the members' colours; pieces of a bend
_AMBIENT, _DIFFUSE = 0.4, 0.35  # together just above one: no colour saturates
# of a round geom, a few pixels wide; more stacks change no pixel that is seen, and cost a third
_SLICES, _STACKS = 14, 4
_INSIDE = ("riser", "tool")
_MOST = 10_000  # drawn shapes; a scene has some hundreds
_EDGE = 2  # pixels around the arm, for the smoothing of its edges
_CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])


def compile_view(site: Site) -> mujoco.MjModel:
    """Compile the scene for the eye: light that keeps colours, and a liner darker than the members."""
    simulation = site.task.simulation
    if simulation.members == "sections":  # whose model has neither tank nor members: nodes pose any other
        shown = simulation.model_copy(update={"members": "rigid"})
        site = replace(site, scene=replace(site.scene, task=site.task.model_copy(update={"simulation": shown})))
    if site.diggings is None:
        model = build_model(site)
    else:
        spec = build_spec(site)
        show_pit(spec, site.tank, site.diggings)
        model = finish_model(spec, site)
        lower_waste(model, site.diggings, site.diggings.start)
    model.mat(f"{names.TANK}/liner").rgba[:3] *= _DIM
    model.vis.headlight.ambient, model.vis.headlight.diffuse = [_AMBIENT] * 3, [_DIFFUSE] * 3
    model.light_diffuse[:] = _DIFFUSE
    model.vis.quality.numslices, model.vis.quality.numstacks = _SLICES, _STACKS
    return model


def count_appeared(tank: Tank, time: float) -> int:
    """How many of the things that appear in a tank are there at a time of the run, s."""
    return sum(when <= time for when in tank.appearances.values())


class Stage:
    """A model that is posed and drawn, with a thread of its own, which its OpenGL context needs; several draw at once."""

    def __init__(self, site: Site, model: mujoco.MjModel, size: tuple[int, int], end: float) -> None:
        """Prepare a copy of a model for pictures of a width and height, pixels; the colour scale ends at this force, N.

        Raises:
            MissingLibraryError: There is no EGL, or not what `MUJOCO_GL` asks for.
        """
        self._model, self._size = copy(model), size
        self._model.vis.global_.offwidth, self._model.vis.global_.offheight = size
        self._replay = make_replay(self._model, site.truss, end)
        self._near = () if site.tank.shell.open else (self._model.geom(f"{names.TANK}/liner/front"),)
        self._wall = [(int(near.matid[0]), near.rgba.copy(), int(near.group[0])) for near in self._near]
        self._scene = mujoco.MjvScene(self._model, _MOST)
        for effect in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_REFLECTION):
            self._scene.flags[effect] = 0
        self._moving = np.flatnonzero(self._model.body_weldid[self._model.geom_bodyid])
        boxes = self._model.geom_aabb[self._moving, None]
        self._corners = boxes[..., :3] + boxes[..., 3:] * _CORNERS
        self._grounds: dict[str, Picture] = {}
        self._diggings = site.diggings
        self._heights: Array | None = None
        self._tank, self._seen = site.tank, -1
        points = [*(goal.position for goal in site.task.motion.goals), *name_things(site).values()]
        self._points = np.array(points).reshape(-1, 3)
        self._line, self._truss = site.task.conveyance, site.truss
        self._thread = ThreadPoolExecutor(1)
        self._close: Callable[[], None] = lambda: None
        try:
            self._thread.submit(self._open).result()
        except (ImportError, AttributeError, RuntimeError, ValueError, mujoco.FatalError) as error:
            # which of them depends on what is missing: the library, its driver, a device or a display
            self.close()
            raise explain_no_picture(error) from None

    def draw(
        self, camera: str, nodes: Array, axial: Array, heights: Array | None = None, time: float = 0.0
    ) -> Future[tuple[Picture, Array]]:
        """Draw nodes in frame G, shape (N, 3), m, members coloured by axial force, shape (M,), N.

        Heights, shape (P,), m, are those of waste that is cut. What appears after a time, s, is not seen.
        The picture, shape (height, width, 3), comes with column and row
        of every goal and thing, see `project`.
        """
        return self._thread.submit(self._draw, camera, nodes, axial, heights, time)

    def close(self) -> None:
        """End the thread and free the memory of the graphics."""
        self._thread.submit(self._close).result()
        self._thread.shutdown()

    def _open(self) -> None:
        context = mujoco.GLContext(*self._size)
        self._close = context.free
        context.make_current()
        self._context = mujoco.MjrContext(self._model, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._context)
        self._close = lambda: (self._context.free(), context.free())[0]

    def _draw(
        self, camera: str, nodes: Array, axial: Array, heights: Array | None, time: float
    ) -> tuple[Picture, Array]:
        pose_model(self._replay, nodes, axial)
        self._lower(heights)
        if (seen := count_appeared(self._tank, time)) != self._seen:
            show_things(self._model, self._tank, time)
            self._seen = seen
            self._grounds.clear()
        whole = (0, 0, *self._size)
        moves = bool(self._model.body_weldid[self._model.cam(camera).bodyid].any())  # the camera, and all with it
        if not moves and camera not in self._grounds:
            self._look(camera, mujoco.mjtCatBit.mjCAT_STATIC)
            self._grounds[camera] = self._take(whole)
        self._look(camera, mujoco.mjtCatBit.mjCAT_ALL)
        self._lay_line(nodes)
        places = project(self._scene, self._points, *self._size)
        if moves:
            return self._take(whole), places
        left, top, right, bottom = box = self._find_arm()
        picture = self._grounds[camera].copy()
        if left < right and top < bottom:
            picture[top:bottom, left:right] = self._take(box)
        return picture, places

    def _lower(self, heights: Array | None) -> None:
        """Show the waste as it is, where it has changed since the picture before."""
        if (
            heights is None
            or self._diggings is None
            or (self._heights is not None and (heights == self._heights).all())
        ):
            return
        lower_waste(self._model, self._diggings, heights)
        mujoco.mjr_uploadHField(self._model, self._context, self._model.hfield(names.PIT).id)
        self._heights = heights
        self._grounds.clear()

    def _look(self, camera: str, shown: mujoco.mjtCatBit) -> None:
        """Fill the scene with what a camera sees; those outside the tank see of its front half a ghost of the wall."""
        view, eye, inside = mujoco.MjvOption(), mujoco.MjvCamera(), camera in _INSIDE
        view.geomgroup[[tank.FRONT_GROUP, tank.FRONT_COVER_GROUP]] = inside
        for near, wall in zip(self._near, self._wall, strict=True):  # an open stand has none
            near.matid, near.rgba, near.group = wall if inside else (-1, _GHOST, tank.INSIDE_GROUP)
        eye.type, eye.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED, self._model.cam(camera).id
        mujoco.mjv_updateScene(self._model, self._replay.data, view, None, eye, shown, self._scene)

    def _lay_line(self, nodes: Array) -> None:
        """Add the line of conveyance through the arm at nodes, shape (N, 3), m, to the filled scene."""
        line, scene = self._line, self._scene
        if line is None:
            return
        points = trace_line(find_axis(self._truss, nodes[None]), _PIECES, jointed=line.kind == "screws")[0]
        kind = mujoco.mjtGeom.mjGEOM_CAPSULE
        for start, end in pairwise(points):
            geom = scene.geoms[scene.ngeom]
            mujoco.mjv_initGeom(geom, kind, np.zeros(3), np.zeros(3), np.zeros(9), np.array(_HOSE, np.float32))
            mujoco.mjv_connector(geom, kind, line.diameter / 2, start, end)
            scene.ngeom += 1

    def _find_arm(self) -> Box:
        """Find the part of the picture that the arm may be in; where it comes beside the camera, the whole."""
        data, width_height = self._replay.data, np.array(self._size)
        turns = data.geom_xmat[self._moving].reshape(-1, 3, 3)
        points = data.geom_xpos[self._moving, None] + self._corners @ np.swapaxes(turns, 1, 2)
        places = project(self._scene, points.reshape(-1, 3), *self._size)
        if not np.isfinite(places).all():
            return 0, 0, *self._size
        low = np.clip(np.floor(places.min(axis=0)) - _EDGE, 0, width_height).astype(int)
        high = np.clip(np.ceil(places.max(axis=0)) + _EDGE, 0, width_height).astype(int)
        return int(low[0]), int(low[1]), int(high[0]), int(high[1])

    def _take(self, box: Box) -> Picture:
        """Draw a part of the picture: its pixels are those of the whole."""
        (left, top, right, bottom), (width, height) = box, self._size
        for eye in self._scene.camera:  # one for each eye of a stereo picture; MuJoCo takes their mean
            pixel = (eye.frustum_top - eye.frustum_bottom) / height
            upper = eye.frustum_top
            eye.frustum_top, eye.frustum_bottom = upper - top * pixel, upper - bottom * pixel
            eye.frustum_center = ((left + right) / 2 - width / 2) * pixel
        pixels = np.empty((bottom - top, right - left, 3), np.uint8)
        corner = mujoco.MjrRect(0, 0, right - left, bottom - top)
        mujoco.mjr_render(corner, self._scene, self._context)
        mujoco.mjr_readPixels(pixels, None, corner, self._context)
        return pixels[::-1]  # OpenGL counts rows from below
