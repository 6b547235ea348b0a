"""The hour in plain Python: STAD coupled as its rig file has it, its loop at the sample time, and a reference.

The levels of TQ1 to TQ3 depend on the flow that arrives, and that changes once a sample, in the middle of one (the
delay is 8.5 samples). So the integrators go from change to change, 0.2 s, restart there and are read half-way:
interval k spans samples k - 1/2 to k + 1/2, its middle is sample k, and the flow of sample k - 9 arrives in it.
"""

import json
import math
import tomllib
from bisect import bisect_right
from dataclasses import dataclass, field
from math import sqrt

import numpy as np
from scipy.integrate import ode

INTERVALS_OF_DELAY = 9


@dataclass
class Hour:
    """What all peers are given, as plain numbers."""

    samples: int
    step_samples: int
    setpoints_cm: list
    start_cm: list
    start_input: float
    h_s: float
    area_cm2: float
    delta2_cm2: float
    k: list  # k(angle) of FV01, FV02, FV03
    curve: list  # inputs and flows of the pump
    noise_cm: float
    range_cm: list
    code_ma: float
    dac_v: float
    low_v: float
    high_v: float
    kc: float
    ti_s: float

    def pump(self, u):
        """Flow in cm^3/s, linear between the points of the table."""
        inputs, flows = self.curve
        i = min(max(bisect_right(inputs, u) - 1, 0), len(inputs) - 2)
        share = min(max((u - inputs[i]) / (inputs[i + 1] - inputs[i]), 0.0), 1.0)
        return flows[i] + share * (flows[i + 1] - flows[i])

    def setpoint(self, sample):
        return self.setpoints_cm[sample // self.step_samples % 2]

    def rates(self):
        """dh/dt in cm/s as a function of three levels and the flow that arrives."""
        k1, k2, k3 = self.k
        area, d2 = self.area_cm2, self.delta2_cm2

        def rates(h1, h2, h3, q):
            x = h1 - h2
            q1 = k1 * h1 / sqrt(sqrt(h1 * h1 + d2))
            q12 = k2 * x / sqrt(sqrt(x * x + d2))
            q3 = k3 * h3 / sqrt(sqrt(h3 * h3 + d2))
            return (q - q1 - q12) / area, q12 / area, (q1 - q3) / area

        return rates


def read_hour(rig_path, vasos):
    """The hour from the rig file and from what Vasos wrote of its own: start, setpoints, length."""
    with open(rig_path, "rb") as file:
        rig = tomllib.load(file)
    coupled = rig["configuration"][0]
    loop = coupled["loop"][0]
    pump = rig["pump"][0]
    sensor = next(s for s in rig["sensor"] if s["id"] == loop["sensor"])
    converters = rig["converters"]
    angle = coupled["angles_deg"]
    hour = Hour(
        samples=vasos["samples"],
        step_samples=vasos["step_samples"],
        setpoints_cm=vasos["setpoints_cm"],
        start_cm=vasos["start"]["levels_cm"],
        start_input=vasos["start"]["input"],
        h_s=rig["sample_time_s"],
        area_cm2=rig["tank"][0]["area_cm2"],
        delta2_cm2=rig["delta_cm"] ** 2,
        k=[v["k90"] * math.sin(math.radians(angle[v["id"]])) ** v["exponent"] for v in rig["valve"]],
        curve=[list(map(float, column)) for column in zip(*pump["curve"])],
        noise_cm=sensor["noise_cm"],
        range_cm=sensor["range_cm"],
        code_ma=1000 * converters["adc_full_scale_v"] / (2 ** converters["adc_bits"] * converters["shunt_ohm"]),
        dac_v=converters["dac_full_scale_v"] / 2 ** converters["dac_bits"],
        low_v=pump["min"],
        high_v=pump["max"],
        kc=loop["kc"],
        ti_s=loop["ti_s"],
    )
    delay_samples = coupled["delays_s"][pump["id"]] / hour.h_s
    assert abs(delay_samples - (INTERVALS_OF_DELAY - 0.5)) < 1e-9, "the delay is not 8.5 samples"
    return hour


@dataclass
class Record:
    """Output to the pump and levels of each sample."""

    inputs: list = field(default_factory=list)
    levels_cm: list = field(default_factory=list)


def run_loop(hour, interval, samples, record=None):
    """The loop around an integrator: `interval(q)` lets an interval pass and gives the levels in its middle."""
    pump, setpoints, step_samples = hour.pump, hour.setpoints_cm, hour.step_samples
    low_cm, span_cm = hour.range_cm[0], hour.range_cm[1] - hour.range_cm[0]
    code_ma, dac_v, low_v, high_v = hour.code_ma, hour.dac_v, hour.low_v, hour.high_v
    kc, integral = hour.kc, hour.kc * hour.h_s / (2 * hour.ti_s)
    noise = (hour.noise_cm * np.random.default_rng(1).standard_normal(samples)).tolist()
    mv = hour.start_input
    air = [pump(mv)] * INTERVALS_OF_DELAY
    last_r = last_y = None
    for sample in range(samples):
        slot = sample % INTERVALS_OF_DELAY
        levels = interval(air[slot])
        wanted_ma = 4.0 + 16.0 * (levels[1] + noise[sample] - low_cm) / span_cm
        current_ma = round(min(max(wanted_ma, 3.8), 20.5) / code_ma) * code_ma
        y = low_cm + span_cm * (current_ma - 4.0) / 16.0
        r = setpoints[sample // step_samples % 2]
        if last_r is None:
            last_r, last_y = r, y
        mv += kc * ((r - y) - (last_r - last_y)) + integral * ((r - y) + (last_r - last_y))
        mv = min(max(mv, low_v), high_v)
        last_r, last_y = r, y
        u = round(mv / dac_v) * dac_v
        air[slot] = pump(u)
        if record is not None:
            record.inputs.append(u)
            record.levels_cm.append(list(levels))


def replay_error_cm(hour, record):
    """Largest difference of a level to DOP853 at 1e-12 that is given the recorded outputs, open loop."""
    rates = hour.rates()
    reference = ode(lambda t, h, q: rates(*h.tolist(), q))
    reference.set_integrator("dop853", rtol=1e-12, atol=1e-12, nsteps=10_000)
    flows = [hour.pump(hour.start_input)] * INTERVALS_OF_DELAY + [hour.pump(u) for u in record.inputs]
    levels = np.array(record.levels_cm[0])
    worst = 0.0
    for sample, found in enumerate(record.levels_cm):
        worst = max(worst, float(np.max(np.abs(levels - found))))
        for flow in flows[sample : sample + 2]:
            reference.set_f_params(flow).set_initial_value(levels, 0.0)
            levels = reference.integrate(0.5 * hour.h_s)
            if not reference.successful():
                raise ArithmeticError(f"the reference stops at sample {sample}")
    return worst


def iae_cm_s(hour, record):
    """Integral of |error| of the true level, as a sign that two loops did the same work."""
    errors = (abs(hour.setpoint(k) - h[1]) for k, h in enumerate(record.levels_cm))
    return hour.h_s * sum(errors)


def for_octave(hour, **more):
    return json.dumps(vars(hour) | more)
