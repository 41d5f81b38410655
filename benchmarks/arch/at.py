"""A car with automatic transmission: engine, torque converter, gears, and what shifts them.

Simulink's ``Autotrans_shift`` (Hoxha, Abbas, Fainekos: Benchmarks for temporal logic requirements
for automotive systems, ARCH 2014).  Equations and constants were read from the model file and from
github.com/ismailbennani/zlscheck, ``arch/arch20`` (``models/at``).

The shift logic is the model's chart, which looks every 0.04 s: a gear changes where the speed is
beyond its threshold two looks later as well.  The sign of the speed, by which brakes act, slides at
rest (Filippov); the model's fixed step chatters there.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from inputs import line, numbers, pieces, surface

import nlctl

TABLES = numbers("at.json")
ENGINE_INERTIA, CAR_INERTIA = 0.0219914882835559, 12.09414785731247
FINAL_DRIVE, DRAG, DRAG_SQUARE = 3.23, 40.0, 0.02
SLOWEST, FASTEST = 600.0, 6000.0  # revolutions per minute of the engine
MPH = 2 * np.pi * 60 / 5280  # of a wheel with radius 1 ft, by its revolutions per minute
LOOK, LOOKS = 0.04, 2  # s between two looks of the shift logic, and for how many it waits
COUNT, PERIOD = 20, 1.5  # pieces of throttle and brake, s

TORQUE = surface(TABLES["throttle"], TABLES["rpm"], TABLES["torque"])
UP = surface(TABLES["up_throttle"], [1, 2, 3, 4], TABLES["up"])
DOWN = surface(TABLES["down_throttle"], [1, 2, 3, 4], TABLES["down"])
CAPACITY = line(TABLES["ratio"], TABLES["capacity"])
TORQUE_RATIO = line(TABLES["ratio"], TABLES["torque_ratio"])


def gear_ratio(gear: Any) -> Any:
    """Return the ratio of a gear."""
    return np.interp(gear, [1.0, 2.0, 3.0, 4.0], TABLES["gears"])


@nlctl.record
class Converter:
    """What the torque converter takes from the engine, and gives to the wheels through a gear."""

    inputs, outputs, states, feedthrough = (
        ("rpm", "wheel", "gear"),
        ("impeller", "torque"),
        (),
        True,
    )

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        """Both torques, by the ratio of the speeds."""
        rpm, wheel, gear = np.maximum(u[0], SLOWEST), u[1], u[2]
        ratio = FINAL_DRIVE * wheel * gear_ratio(gear) / rpm
        impeller = (rpm / CAPACITY(ratio)) ** 2
        return impeller, impeller * TORQUE_RATIO(ratio) * gear_ratio(gear)


def engine_rate(rpm: Any, u: Any) -> Any:
    """Return what moves the engine: torque of the map less that of the converter."""
    throttle, impeller = u
    return (TORQUE([[throttle, rpm]])[0] - impeller) / ENGINE_INERTIA


@nlctl.record
class Engine:
    """Its speed in revolutions per minute; at a limit it stays until the torque leads back."""

    inputs, outputs, feedthrough = ("throttle", "impeller"), ("rpm",), False
    states = ("rpm", "limit")  # 1 at the upper limit, -1 at the lower one
    initial = {"rpm": 1000.0}

    @staticmethod
    @nlctl.equation
    def update(t, x, u, p):
        """The rate between the limits."""
        rpm, limit = x
        return np.where(abs(limit) < 0.5, engine_rate(rpm, u), 0.0 * rpm), 0.0

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        """The state."""
        return (x[0],)

    @staticmethod
    @nlctl.equation
    def guard(t, x, u, p):
        """How far it is from a limit; at one, what holds it there."""
        rpm, limit = x
        free = np.minimum(rpm - SLOWEST, FASTEST - rpm)
        return (np.where(abs(limit) < 0.5, free, limit * engine_rate(rpm, u)),)

    @staticmethod
    @nlctl.equation
    def reset(t, x, u, p):
        """To the limit, or away from it."""
        rpm, limit = x
        upper = rpm > (SLOWEST + FASTEST) / 2
        free = abs(limit) < 0.5
        met, side = np.where(upper, FASTEST, SLOWEST), np.where(upper, 1.0, -1.0)
        return np.where(free, met, rpm), np.where(free, side, 0.0)


@nlctl.record
class Car:
    """Speed of the wheels, and of the car in mph, twice: u is what its direction is read from."""

    inputs, outputs = ("torque", "brake", "v"), ("wheel", "speed", "u")
    states, feedthrough = ("wheel",), False

    @staticmethod
    @nlctl.equation
    def update(t, x, u, p):
        """Torque of the gear box less brake and drag, which act against the motion."""
        torque, brake, direction = u
        load = brake + DRAG + DRAG_SQUARE * (MPH * x[0]) ** 2
        return ((FINAL_DRIVE * torque - direction * load) / CAR_INERTIA,)

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        """The state in both units."""
        return x[0], MPH * x[0], MPH * x[0]


def look(x: Any, u: Any) -> Any:
    """Return gear, mode (1 shifting up, -1 down, 0 neither) and looks in it, after a look."""
    gear, mode, looks = x
    throttle, speed = u
    up, down = UP([[throttle, gear]])[0], DOWN([[throttle, gear]])[0]
    steady = np.where(speed < down, -1.0, np.where(speed > up, 1.0, 0.0 * speed))
    beyond = np.where(mode > 0, up <= speed, speed <= down)
    done = beyond & (looks + 1 >= LOOKS)
    shifted = np.clip(gear + np.where(done, mode, 0.0), 1.0, 4.0)
    waiting = np.where(beyond & ~done, mode, 0.0)
    shifting = mode != 0
    return (
        np.where(shifting, shifted, gear),
        np.where(shifting, waiting, steady),
        np.where(shifting, looks + 1, 0.0),
    )


@nlctl.record
class ShiftLogic:
    """The chart: first to fourth gear."""

    inputs, outputs, states = ("throttle", "speed"), ("gear",), ("gear", "mode", "looks")
    feedthrough, discrete = True, True
    initial = {"gear": 1.0}

    @staticmethod
    @nlctl.equation
    def update(t, x, u, p):
        """What a look changes."""
        return look(x, u)

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        """The gear after the look."""
        return (look(x, u)[0],)


def car(**pedals: Any) -> Any:
    """Return the car; throttle and brake are given blocks, or inputs of the diagram."""
    parts = {
        "shift": nlctl.sampled(nlctl.block(ShiftLogic(), "shift", dt=LOOK)),
        "converter": Converter(), "engine": Engine(), "car": Car(), "direction": nlctl.IdealRelay(),
    }  # fmt: skip
    outside = [pedal for pedal in ("throttle", "brake") if pedal not in pedals]
    return nlctl.interconnect({**pedals, **parts}, inputs=outside, outputs=["speed", "rpm", "gear"])


def plant() -> Any:
    """Return the car whose pedals are constant for 1.5 s each."""
    return car(throttle=pieces("throttle", COUNT, PERIOD), brake=pieces("brake", COUNT, PERIOD))
