"""One class a peer: made for an hour, put to levels by `start`, and let run by `interval(q)` for the 0.2 s between two
changes of the flow, of which it gives the levels in the middle.

Tolerances are the widest of 1, 2, 5 times a power of ten at which the replay of the hour stays under 1e-6 cm. Whatever is compiled is
compiled once, before the hour, and no solver is made inside it. Each peer is used in the fastest way that its
documented interface was found to have.
"""

from importlib.metadata import version

import numpy as np

from plant import INTERVALS_OF_DELAY, run_loop


class Peer:
    """A peer with plain Python around it."""

    name = package = how = ""
    tolerance = None
    # Right-hand sides of the hour, where they can be counted; that is done outside the timed runs.
    evaluations = None

    def __init__(self, hour):
        self.hour = hour
        self.half_s, self.whole_s = 0.5 * hour.h_s, hour.h_s

    @property
    def version(self):
        return version(self.package)

    def start(self, counting):
        self.levels = np.array(self.hour.start_cm)

    def run(self, samples, record=None):
        self.start(counting=record is not None)
        run_loop(self.hour, self.interval, samples, record)


class Calling(Peer):
    """A peer that calls back into Python for each right-hand side."""

    def counted(self, plain, counting):
        if not counting:
            return plain
        self.evaluations = 0

        def count(*arguments):
            self.evaluations += 1
            return plain(*arguments)

        return count


class Lsoda(Calling):
    name, package = "scipy LSODA", "scipy"
    how = "`integrate.ode`, set to each new flow"
    tolerance = 1e-8

    def right_hand_side(self):
        rates = self.hour.rates()
        return lambda t, h, q: rates(*h.tolist(), q)

    def start(self, counting):
        from scipy.integrate import ode

        super().start(counting)
        self.solver = ode(self.counted(self.right_hand_side(), counting))
        self.solver.set_integrator("lsoda", rtol=self.tolerance, atol=self.tolerance)

    def interval(self, q):
        solver = self.solver
        solver.set_f_params(q).set_initial_value(self.levels, 0.0)
        # scipy gives the same array each time.
        middle = solver.integrate(self.half_s).copy()
        self.levels = solver.integrate(self.whole_s)
        return middle


class LsodaNumba(Lsoda):
    name = "scipy LSODA, numba"
    how = "the same, right-hand side compiled by numba"

    def __init__(self, hour):
        super().__init__(hour)
        from numba import njit

        rates = njit(error_model="numpy")(hour.rates())
        self.compiled = njit(lambda t, h, q: np.array(rates(h[0], h[1], h[2], q)))

    def right_hand_side(self):
        return self.compiled

    @property
    def version(self):
        return f"{version('scipy')}, {version('numba')}"


class Cvode(Calling):
    name, package = "scikit-sundae CVODE", "scikit-sundae"
    how = "Adams; `init_step` at each new flow"
    tolerance = 5e-9

    def start(self, counting):
        from sksundae.cvode import CVODE

        super().start(counting)
        rates = self.hour.rates()

        def plain(t, h, dh):
            dh[0], dh[1], dh[2] = rates(*h.tolist(), self.q)

        counted = self.counted(plain, counting)
        # CVODE counts a function's arguments, so it has to have a fixed number of them.
        side = (lambda t, h, dh: counted(t, h, dh)) if counting else plain
        self.solver = CVODE(side, method="Adams", rtol=self.tolerance, atol=self.tolerance)

    def interval(self, q):
        self.q = q
        solver = self.solver
        solver.init_step(0.0, self.levels)
        middle = solver.step(self.half_s, tstop=self.whole_s).y
        self.levels = solver.step(self.whole_s, tstop=self.whole_s).y
        return middle


class Casadi(Peer):
    """A compiled graph; its buffers are written and read in place."""

    package = "casadi"
    plugin = ""
    options = {}

    def __init__(self, hour):
        super().__init__(hour)
        import casadi

        h, q = casadi.SX.sym("h", 3), casadi.SX.sym("q")
        k1, k2, k3 = hour.k

        def root(x):
            return x / casadi.sqrt(casadi.sqrt(x * x + hour.delta2_cm2))

        q1, q12, q3 = k1 * root(h[0]), k2 * root(h[0] - h[1]), k3 * root(h[2])
        problem = {"x": h, "p": q, "ode": casadi.vertcat(q - q1 - q12, q12, q1 - q3) / hour.area_cm2}
        options = dict(self.options)
        if self.tolerance:
            options.update(reltol=self.tolerance, abstol=self.tolerance)
        self.function = casadi.integrator("hour", self.plugin, problem, 0.0, [self.half_s, self.whole_s], options)
        self.levels, self.flow, self.found = np.zeros(3), np.zeros(1), np.zeros((2, 3))
        self.buffer, self.trigger = self.function.buffer()
        self.buffer.set_arg(self.function.index_in("x0"), memoryview(self.levels))
        self.buffer.set_arg(self.function.index_in("p"), memoryview(self.flow))
        self.buffer.set_res(self.function.index_out("xf"), memoryview(self.found))

    def start(self, counting):
        self.levels[:] = self.hour.start_cm

    def interval(self, q):
        self.flow[0] = q
        self.trigger()
        middle, self.levels[:] = self.found
        return middle


class CasadiCvodes(Casadi):
    name, plugin, tolerance = "CasADi CVODES", "cvodes", 5e-9
    how = "Adams, functional iteration; one call an interval"
    options = {"linear_multistep_method": "adams", "nonlinear_solver_iteration": "functional"}


class CasadiRk(Casadi):
    name, plugin = "CasADi Runge-Kutta", "rk"
    how = "fixed steps of 0.05 s; one call an interval"
    options = {"number_of_finite_elements": 4, "simplify": True}


class Diffsol(Peer):
    name, package = "pydiffsol", "pydiffsol"
    how = "Tsitouras 5(4), compiled by LLVM; one `solve_dense` an interval"
    tolerance = 1e-6

    def __init__(self, hour):
        super().__init__(hour)
        import pydiffsol

        k1, k2, k3 = hour.k
        area, d2 = hour.area_cm2, hour.delta2_cm2
        code = f"""
            in_i {{ s1 = 1, s2 = 1, s3 = 1, q = 1 }}
            u_i {{ h1 = s1, h2 = s2, h3 = s3 }}
            x {{ h1 - h2 }}
            q1 {{ {k1!r} * h1 / sqrt(sqrt(h1 * h1 + {d2!r})) }}
            q12 {{ {k2!r} * x / sqrt(sqrt(x * x + {d2!r})) }}
            q3 {{ {k3!r} * h3 / sqrt(sqrt(h3 * h3 + {d2!r})) }}
            F_i {{ (q - q1 - q12) / {area!r}, q12 / {area!r}, (q1 - q3) / {area!r} }}
        """
        self.ode = pydiffsol.Ode(
            code, matrix_type=pydiffsol.nalgebra_dense, ode_solver=pydiffsol.tsit45
        )
        self.ode.rtol = self.ode.atol = self.tolerance
        self.ode.h0 = self.half_s
        self.times = np.array([self.half_s, self.whole_s])
        self.parameters = np.zeros(4)

    def start(self, counting):
        self.parameters[:3] = self.hour.start_cm

    def interval(self, q):
        parameters = self.parameters
        parameters[3] = q
        found = self.ode.solve_dense(parameters, self.times).ys
        parameters[:3] = found[:, 1]
        return found[:, 0]


class Compiled(Peer):
    """The whole hour, controller and converters included, in one function compiled by numba."""

    def __init__(self, hour):
        super().__init__(hour)
        self.function = self.compile(self.make_interval())

    def compile(self, interval):
        from numba import njit

        hour = self.hour
        first_v, step_v = hour.curve[0][0], hour.curve[0][1] - hour.curve[0][0]
        flows = np.array(hour.curve[1])
        assert np.allclose(np.diff(hour.curve[0]), step_v), "the points of the pump's table are not equidistant"
        setpoints, step_samples = np.array(hour.setpoints_cm), hour.step_samples
        low_cm, span_cm = hour.range_cm[0], hour.range_cm[1] - hour.range_cm[0]
        code_ma, dac_v, low_v, high_v = hour.code_ma, hour.dac_v, hour.low_v, hour.high_v
        kc, integral = hour.kc, hour.kc * hour.h_s / (2 * hour.ti_s)
        start, start_input, noise_cm = np.array(hour.start_cm), hour.start_input, hour.noise_cm

        @njit(error_model="numpy")
        def pump(u):
            place = min(max((u - first_v) / step_v, 0.0), flows.size - 1.0)
            i = min(int(place), flows.size - 2)
            return flows[i] + (place - i) * (flows[i + 1] - flows[i])

        @njit(error_model="numpy")
        def run(samples, written, levels_cm):
            np.random.seed(1)
            mv = start_input
            air = np.full(INTERVALS_OF_DELAY, pump(mv))
            state = (start[0], start[1], start[2])
            last_r = last_y = 0.0
            for sample in range(samples):
                slot = sample % INTERVALS_OF_DELAY
                middle, state = interval(state, air[slot])
                level_cm = middle[1] + noise_cm * np.random.standard_normal()
                wanted_ma = 4.0 + 16.0 * (level_cm - low_cm) / span_cm
                current_ma = np.rint(min(max(wanted_ma, 3.8), 20.5) / code_ma) * code_ma
                y = low_cm + span_cm * (current_ma - 4.0) / 16.0
                r = setpoints[sample // step_samples % 2]
                if sample == 0:
                    last_r, last_y = r, y
                mv += kc * ((r - y) - (last_r - last_y)) + integral * ((r - y) + (last_r - last_y))
                mv = min(max(mv, low_v), high_v)
                last_r, last_y = r, y
                u = np.rint(mv / dac_v) * dac_v
                air[slot] = pump(u)
                written[sample] = u
                levels_cm[sample, 0], levels_cm[sample, 1], levels_cm[sample, 2] = middle

        return run

    def run(self, samples, record=None):
        written, levels_cm = np.zeros(samples), np.zeros((samples, 3))
        self.function(samples, written, levels_cm)
        if record is not None:
            record.inputs, record.levels_cm = written.tolist(), levels_cm.tolist()


class NumbaLsoda(Compiled):
    name, package = "numbalsoda", "numbalsoda"
    how = "LSODA called from the hour compiled by numba"
    tolerance = 1e-8

    @property
    def version(self):
        return f"{version('numbalsoda')}, numba {version('numba')}"

    def make_interval(self):
        from numba import cfunc, njit
        from numbalsoda import lsoda, lsoda_sig

        rates = njit(error_model="numpy")(self.hour.rates())
        times, tolerance = np.array([0.0, self.half_s, self.whole_s]), self.tolerance

        @cfunc(lsoda_sig)
        def side(t, h, dh, data):
            dh[0], dh[1], dh[2] = rates(h[0], h[1], h[2], data[0])

        address = side.address
        self.side = side

        @njit
        def interval(state, q):
            found, _ = lsoda(address, np.array(state), times, np.array([q]), tolerance, tolerance)
            m, e = found[1], found[2]
            return (m[0], m[1], m[2]), (e[0], e[1], e[2])

        return interval


class NumbaRk(Compiled):
    name, package = "numba, own Runge-Kutta", "numba"
    how = "RK4 by hand, steps of 0.05 s, the hour compiled"
    steps = 4

    def make_interval(self):
        from numba import njit

        rates = njit(error_model="numpy")(self.hour.rates())
        half, step = self.steps // 2, self.whole_s / self.steps

        @njit(error_model="numpy")
        def along(a, k, s):
            return a[0] + s * k[0], a[1] + s * k[1], a[2] + s * k[2]

        @njit(error_model="numpy")
        def pass_half(h, q):
            for _ in range(half):
                k1 = rates(h[0], h[1], h[2], q)
                a = along(h, k1, step / 2)
                k2 = rates(a[0], a[1], a[2], q)
                a = along(h, k2, step / 2)
                k3 = rates(a[0], a[1], a[2], q)
                a = along(h, k3, step)
                k4 = rates(a[0], a[1], a[2], q)
                mean = (
                    (k1[0] + 2 * k2[0] + 2 * k3[0] + k4[0]) / 6,
                    (k1[1] + 2 * k2[1] + 2 * k3[1] + k4[1]) / 6,
                    (k1[2] + 2 * k2[2] + 2 * k3[2] + k4[2]) / 6,
                )
                h = along(h, mean, step)
            return h

        @njit(error_model="numpy")
        def interval(state, q):
            middle = pass_half(state, q)
            return middle, pass_half(middle, q)

        return interval

    def run(self, samples, record=None):
        super().run(samples, record)
        self.evaluations = 4 * self.steps * samples


PEERS = [Lsoda, LsodaNumba, Cvode, CasadiCvodes, CasadiRk, Diffsol, NumbaLsoda, NumbaRk]
