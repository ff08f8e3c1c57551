"""The multibody benchmarks by one coordinate each and scipy: no body, no row and no step of MuJoCo takes part."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.integrate import solve_ivp

GRAVITY = 9.81
TIGHT = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13}
_CORNERS = np.array([(0, 0, 0), (1, 0, 0), (1, -1, 0), (1, -1, 1), (0, -1, 1), (0, 0, 1)], float)
_AXES = np.array([(0, 1, 0), (0, 0, 1), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 0)], float)
_SIDE = 1e-3  # of the differences of fourth order along the path, rad: truncation and rounding both leave 1e-12


def pendulum(time):
    """Angle from straight down; released at a quarter turn."""
    angle = _go(lambda a: -GRAVITY * np.sin(a), -np.pi / 2, 0.0, time)
    return np.array([np.sin(angle), -np.cos(angle), 0.0])


def four_bars(time, count, gained=0.0):
    """All uprights turn alike, so level bars do not turn: with M the moment of inertia of all, angle'' = W sin(angle) / M.

    They start at 1 rad/s, or with so much more energy, J.
    """
    inertia = (count + 1) / 3 + count
    weight = GRAVITY * ((count + 1) / 2 + count)
    angle = _go(lambda a: weight / inertia * np.sin(a), 0.0, np.sqrt(1 + 2 * gained / inertia), time)
    return np.array([np.sin(angle), np.cos(angle), 0.0])


def _go(acceleration, angle, rate, time):
    return solve_ivp(lambda _, y: [y[1], acceleration(y[0])], (0, time), [angle, rate], **TIGHT).y[0, -1]


@lru_cache
def bricard(time):
    """Angles of the first five hinges; the sixth closes the loop, which leaves one way to move, with the first at unit rate."""

    def rates(_, y):
        way = _way(y[:5])
        near = [y[:5] + side * _SIDE * way for side in (-2, -1, 1, 2)]
        slope = np.dot([1, -8, 8, -1], [_inertia(place, _way(place)) for place in near]) / (12 * _SIDE)
        fall = GRAVITY * sum(speed[1] for speed, _, _ in _motion(y[:5], way))
        return [*(way * y[5]), -(slope * y[5] ** 2 / 2 + fall) / _inertia(y[:5], way)]

    end = solve_ivp(rates, (0, time), np.zeros(6), method="DOP853", rtol=1e-8, atol=1e-9).y[:5, -1]
    turn, shift = _frames(end)[2]
    return turn @ _CORNERS[3] + shift


def _frames(angles):
    """Turn and shift of each rod from where it starts."""
    turn, shift, frames = np.eye(3), np.zeros(3), []
    for angle, axis, corner in zip(angles, _AXES, _CORNERS, strict=False):
        cross = np.cross(np.eye(3), axis)
        step = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
        shift = turn @ (corner - step @ corner) + shift
        turn = turn @ step
        frames.append((turn, shift))
    return frames


def _hinges(angles):
    """Axis and place of each of the five hinges, and the frames of the rods."""
    frames = _frames(angles)
    before = [(np.eye(3), np.zeros(3)), *frames[:-1]]
    axes = [turn @ axis for (turn, _), axis in zip(before, _AXES, strict=False)]
    places = [turn @ corner + shift for (turn, shift), corner in zip(before, _CORNERS, strict=False)]
    return axes, places, frames


def _way(angles):
    """Rates of the hinges that keep the last corner and the last hinge's axis where they are; the first is 1 rad/s."""
    axes, places, frames = _hinges(angles)
    turn, shift = frames[-1]
    corner, axis = turn @ _CORNERS[5] + shift, turn @ _AXES[5]
    rows = [[*np.cross(a, corner - p), *np.cross(a, axis)] for a, p in zip(axes, places, strict=True)]
    way = np.linalg.svd(np.array(rows).T)[2][-1]
    return way / way[0]


def _motion(angles, way):
    """Velocity of each rod's middle, its angular velocity and its turn."""
    axes, places, frames = _hinges(angles)
    found = []
    for index, (turn, shift) in enumerate(frames):
        middle = turn @ _CORNERS[index : index + 2].mean(axis=0) + shift
        part = range(index + 1)
        speed = sum(way[k] * np.cross(axes[k], middle - places[k]) for k in part)
        found.append((speed, sum(way[k] * axes[k] for k in part), turn))
    return found


def _inertia(angles, way):
    """Twice the energy of that motion."""
    total = 0.0
    for index, (speed, spin, turn) in enumerate(_motion(angles, way)):
        along = np.abs(_CORNERS[index + 1] - _CORNERS[index])
        moments = np.where(along > 0, 2 * 0.01, 1.01) / 12
        total += speed @ speed + (turn.T @ spin) ** 2 @ moments
    return total
