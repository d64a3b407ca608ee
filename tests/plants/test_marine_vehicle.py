"""The vehicle in six degrees of freedom against published numbers, an independent simulator, and what a regression finds."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from gainful.plants import (
    MarineVehicle,
    SingleDofVehicle,
    VehicleStructure,
    bluerov2,
    gravity_direction,
    vehicle_rows,
    weak_vehicle_rows,
)
from gainful.regression import information, least_squares

DT = 0.05  # s
STRUCTURES = {
    "lever": VehicleStructure(),
    "symmetric": VehicleStructure(mass="symmetric", drag="symmetric", levers=("x", "z"), offsets=("surge",)),
    "full": VehicleStructure(mass="full", drag="full", levers=("x", "y", "z"), offsets=("heave", "yaw")),
}


def wrench(t):
    """The published excitation [N, N m]."""
    i, k = jnp.arange(6)[:, None], jnp.arange(1, 6)
    phase = 2.0 * jnp.pi * ((0.618034 * (k + 5 * i) ** 2) % 1.0)
    amplitude = jnp.array([9.0, 9.0, 5.0, 0.3, 0.3, 0.5])
    return 0.5 * amplitude * jnp.sin(2.0 * jnp.pi * (0.02 + 0.045 * k + 0.007 * i) * t + phase).sum(axis=1)


@pytest.fixture(scope="module")
def motion():
    return bluerov2().simulate(DT * jnp.arange(3000), wrench)


def some_vehicle(structure: VehicleStructure, rng: np.random.Generator) -> MarineVehicle:
    """A vehicle with a number for every parameter of a structure, heavy on the diagonals."""
    own = {"mass": 20.0, "inertia": 5.0, "linear": 3.0, "quadratic": 4.0}
    theta = [
        own.get(name.split("_")[0], 0.0) * (name.count("_") == 1 + ("drag" in name)) + 0.3 * rng.standard_normal()
        for name in structure.names
    ]
    r_b = np.array([0.01, 0.0, 0.005]) if "x" in structure.levers else np.zeros(3)
    blank = MarineVehicle(np.eye(6), np.eye(6), np.eye(6), 100.0, 100.0, r_b, r_b, structure=structure)
    return blank.with_parameters(jnp.asarray(theta))


def cross(v):
    x, y, z = v
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def simulated_wrench(vehicle: MarineVehicle, nudot, nu, roll, pitch):
    """Fossen's equations in angles, written once more."""
    M, D, D2 = (np.asarray(each) for each in (vehicle.mass_matrix, vehicle.linear_drag, vehicle.quadratic_drag))
    v, w = nu[:3], nu[3:]
    upper, lower = M[:3, :3] @ v + M[:3, 3:] @ w, M[3:, :3] @ v + M[3:, 3:] @ w
    C = np.block([[np.zeros((3, 3)), -cross(upper)], [-cross(upper), -cross(lower)]])
    W, B = float(vehicle.weight), float(vehicle.buoyancy)
    x, y, z = W * np.asarray(vehicle.r_g) - B * np.asarray(vehicle.r_b)
    s, c, sf, cf = np.sin(pitch), np.cos(pitch), np.sin(roll), np.cos(roll)
    gravity = [
        (W - B) * s,
        -(W - B) * c * sf,
        -(W - B) * c * cf,
        -y * c * cf + z * c * sf,
        z * s + x * c * cf,
        -x * c * sf - y * s,
    ]
    return M @ nudot + C @ nu + D @ nu + D2 @ (nu * np.abs(nu)) + gravity + np.asarray(vehicle.offset)


def test_the_wrench_of_a_motion_is_the_published_one() -> None:
    nu, nudot = jnp.array([0.5, -0.2, 0.1, 0.05, -0.1, 0.3]), jnp.array([0.1, 0.2, -0.1, 0.3, 0.1, -0.2])
    found = bluerov2().wrench(nudot, nu, jnp.array([0.1, -0.05]))
    published = [9.5777083385, 5.2727673017, 0.8735463383, 0.1995677164, -0.5262530059, -0.6155]
    np.testing.assert_allclose(found, published, atol=1e-9)


@pytest.mark.parametrize("structure", STRUCTURES.values(), ids=list(STRUCTURES))
def test_regressors_times_parameters_are_an_independent_simulators_wrench(structure, rng: np.random.Generator) -> None:
    vehicle = some_vehicle(structure, rng)
    nudot, nu, attitude = rng.standard_normal((4, 6)), rng.standard_normal((4, 6)), rng.uniform(-1.4, 1.4, (4, 2))
    expected = [simulated_wrench(vehicle, *each) for each in zip(nudot, nu, *attitude.T, strict=True)]
    np.testing.assert_allclose(vehicle.wrench(nudot, nu, attitude), expected, rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(
        vehicle.regressor(nudot, nu, attitude) @ vehicle.parameters, expected, rtol=1e-10, atol=1e-10
    )
    np.testing.assert_allclose(vehicle.acceleration(nu, attitude, np.array(expected)), nudot, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("structure", STRUCTURES.values(), ids=list(STRUCTURES))
def test_the_mass_matrix_is_symmetric_and_its_coriolis_forces_do_no_work(structure, rng: np.random.Generator) -> None:
    vehicle = some_vehicle(structure, rng)
    M = np.asarray(vehicle.mass_matrix)
    assert np.array_equal(M, M.T)
    nu = rng.standard_normal(6)
    C = np.asarray(vehicle.coriolis(nu))
    np.testing.assert_allclose(C, -C.T, atol=1e-12)
    assert abs(nu @ C @ nu) < 1e-10
    still = eqx.tree_at(lambda v: v.mass_matrix, vehicle, jnp.zeros((6, 6)))
    forces = vehicle.remaining(nu, np.zeros(2)) - still.remaining(nu, np.zeros(2))
    np.testing.assert_allclose(C @ nu, forces, atol=1e-12)


@pytest.mark.parametrize("structure", STRUCTURES.values(), ids=list(STRUCTURES))
def test_a_regression_without_noise_finds_all_parameters(structure, rng: np.random.Generator) -> None:
    vehicle = some_vehicle(structure, rng)
    nudot, nu, attitude = rng.standard_normal((80, 6)), rng.standard_normal((80, 6)), rng.uniform(-1.4, 1.4, (80, 2))
    H = np.asarray(vehicle.regressor(nudot, nu, attitude)).reshape(-1, len(structure.names))
    theta = np.linalg.lstsq(H, np.asarray(vehicle.wrench(nudot, nu, attitude)).ravel(), rcond=None)[0]
    np.testing.assert_allclose(theta, vehicle.parameters, rtol=1e-9, atol=1e-9)


def test_structures_leave_out_what_symmetry_forbids() -> None:
    assert [len(each.names) for each in STRUCTURES.values()] == [21, 12 + 2 * 18 + 1 + 2 + 1, 21 + 2 * 36 + 1 + 3 + 2]
    symmetric = STRUCTURES["symmetric"]
    assert "mass_surge_pitch" in symmetric.names
    assert "mass_surge_sway" not in symmetric.names
    assert symmetric.units["mass_sway_roll"] == "kg*m"
    assert symmetric.units["linear_drag_yaw_sway"] == "N*s"


def test_the_published_motion_recovers_its_parameters_exactly_and_its_rows_nearly(motion) -> None:
    vehicle = bluerov2()
    # Published peaks: 0.63 m/s, 0.93 rad/s, roll 30 and pitch 35 degrees.
    assert np.abs(motion.nu[:, :3]).max() == pytest.approx(0.63, abs=0.005)
    assert np.abs(motion.nu[:, 3:]).max() == pytest.approx(0.93, abs=0.005)
    np.testing.assert_allclose(np.degrees(np.abs(motion.attitude[:, :2]).max(axis=0)), [30.0, 35.0], atol=0.2)
    assert motion.cautions == ()
    exact = jnp.concatenate(
        [vehicle.regressor(motion.nudot, motion.nu, motion.attitude), motion.wrench[..., None]], axis=-1
    )
    np.testing.assert_allclose(_fit(exact), vehicle.parameters, rtol=1e-9)
    record = (vehicle.structure, motion.nu, motion.attitude, motion.wrench, DT)
    # Of motion up to 0.3 Hz steps of 0.05 s lose (0.05 * 2 pi * 0.3)^4 / 30 at most, and a window of 0.75 s, which filters both
    # sides alike, little more; drag is a tenth of the wrench, and its error ten times that.
    np.testing.assert_allclose(_fit(vehicle_rows(*record)), vehicle.parameters, rtol=3e-3)
    np.testing.assert_allclose(_fit(weak_vehicle_rows(*record)), vehicle.parameters, rtol=3e-3)


def _fit(rows):
    """Parameters by least squares, through the triangle of a QR, whose condition is not squared."""
    flat = np.asarray(rows).reshape(-1, rows.shape[-1])
    return np.linalg.lstsq(flat[:, :-1], flat[:, -1], rcond=None)[0]


def test_rows_weigh_equations_as_regression_weighs_sensors(motion) -> None:
    rows = weak_vehicle_rows(VehicleStructure(), motion.nu, motion.quaternion, motion.wrench, DT)
    assert rows.shape == (3000 - 14, 6, 22)
    weighted = least_squares(information(rows, [1.0, 1.0, 1.0, 100.0, 100.0, 100.0])).theta
    np.testing.assert_allclose(weighted, bluerov2().parameters, rtol=3e-3)


@pytest.mark.parametrize("make", [vehicle_rows, weak_vehicle_rows])
def test_the_noise_of_velocities_is_taken_out_of_the_squares_of_drag(make, motion, rng: np.random.Generator) -> None:
    sigma, structure = np.full(6, 0.05), VehicleStructure()
    square = structure.names.index("quadratic_drag_surge")
    clean = make(structure, motion.nu, motion.attitude, motion.wrench, DT)[:, 0, square]
    noisy = motion.nu + sigma * rng.standard_normal(motion.nu.shape)
    excess = [
        np.mean(
            (make(structure, noisy, motion.attitude, motion.wrench, DT, std=std)[:, 0, square] - clean) * np.sign(clean)
        )
        for std in (None, sigma)
    ]
    # Without the correction the excess is sigma^2; the mean of 3000 such differences has a standard deviation of about
    # 2 * 0.3 m/s * sigma / sqrt(3000), a fifth of it.
    assert excess[0] == pytest.approx(0.05**2, abs=0.8 * 0.05**2)
    assert abs(excess[1]) < 0.8 * 0.05**2


def test_one_degree_of_freedom_at_a_time_misreads_coupled_motion() -> None:
    motion = bluerov2().simulate(DT * jnp.arange(4000), wrench)
    expected = {0: ([11.7, 26.7, -14.4], 0.75), 5: ([0.09, 0.54, -0.06], 0.42)}
    for dof, (published, share) in expected.items():
        H, z = (
            np.asarray(SingleDofVehicle.regressor(motion.nudot[:, dof], motion.nu[:, dof])),
            np.asarray(motion.wrench[:, dof]),
        )
        theta = np.linalg.lstsq(H, z, rcond=None)[0]
        told = 1.0 - np.sum((z - H @ theta) ** 2) / np.sum((z - z.mean()) ** 2)
        # Half of the last digit published, and a little for the one before it.
        np.testing.assert_allclose(theta, published, atol=0.06 if dof == 0 else 0.006)
        assert told == pytest.approx(share, abs=0.006)


def test_a_vehicle_in_one_degree_of_freedom_is_the_single_one() -> None:
    single = SingleDofVehicle(17.0, 4.03, 18.18, turning=False)
    t = DT * jnp.arange(100)
    push = jnp.zeros((100, 6)).at[:, 0].set(10.0 * jnp.sin(t))
    diagonal = (17.0, 20.0, 20.0, 1.0, 1.0, 1.0)
    neutral = MarineVehicle(diagonal, (4.03,) * 6, (18.18,) * 6, 100.0, 100.0, np.zeros(3))
    moved = neutral.simulate(t, push)
    np.testing.assert_allclose(moved.nu[:, 0], single.simulate(t, push[:, 0]), atol=1e-14)
    assert not np.any(moved.nu[:, 1:])


def test_parameters_of_a_regression_make_a_vehicle() -> None:
    vehicle = bluerov2()
    again = vehicle.with_parameters(vehicle.parameters)
    np.testing.assert_allclose(again.parameters, vehicle.parameters, rtol=1e-14)
    np.testing.assert_allclose([again.weight, again.r_g[2]], [112.8, 0.02], rtol=1e-12)


def test_attitudes_as_angles_and_as_quaternions_point_down_alike(motion) -> None:
    down = gravity_direction(motion.quaternion)
    np.testing.assert_allclose(gravity_direction(motion.attitude), down, atol=1e-12)
    np.testing.assert_allclose(gravity_direction(motion.attitude[:, :2]), down, atol=1e-12)
    np.testing.assert_allclose(jnp.sum(down**2, axis=1), 1.0, atol=1e-12)


def test_a_start_in_angles_is_where_the_motion_starts() -> None:
    start = jnp.array([0.2, -0.4, 2.0])
    moved = bluerov2().simulate(jnp.arange(2.0) * 0.01, jnp.zeros((2, 6)), attitude=start)
    np.testing.assert_allclose(moved.attitude[0], start, atol=1e-12)


def test_pitch_through_the_vertical_is_told_and_breaks_nothing() -> None:
    steady = eqx.tree_at(
        lambda v: (v.linear_drag, v.quadratic_drag), bluerov2(), (jnp.zeros((6, 6)), jnp.zeros((6, 6)))
    )
    neutral = eqx.tree_at(lambda v: (v.weight, v.r_g), steady, (steady.buoyancy, jnp.zeros(3)))
    level = eqx.tree_at(lambda v: v.mass_matrix, neutral, jnp.diag(jnp.diagonal(neutral.mass_matrix)))
    t = jnp.arange(101) * 0.05
    moved = level.simulate(t, jnp.zeros((101, 6)), nu=jnp.array([0.0, 0.0, 0.0, 0.0, 0.5, 0.0]))
    # Half a radian per second for five seconds: over the vertical, to where down points along the angle reached.
    np.testing.assert_allclose(moved.nu[-1], moved.nu[0], atol=1e-12)
    angle = 0.5 * np.asarray(t)
    np.testing.assert_allclose(gravity_direction(moved.quaternion)[:, 0], -np.sin(angle), atol=1e-8)
    (text,) = moved.cautions
    # The nearest of the angles is 3.15 / 2 rad; 5 degrees either way are 7 steps of 1.43.
    assert text.startswith("pitch comes within 0.24 degrees of 90")
    assert "in 7 of 101 rows; take the quaternion" in text


def test_numbers_that_are_not_physical_are_told_and_kept() -> None:
    vehicle = bluerov2()
    names = vehicle.structure.names
    assert vehicle.cautions == ()

    def cautions(**changes: float) -> tuple[str, ...]:
        theta = vehicle.parameters
        for name, value in changes.items():
            theta = theta.at[names.index(name)].set(value)
        changed = vehicle.with_parameters(theta)
        np.testing.assert_allclose(changed.parameters, theta, rtol=1e-12)
        return changed.cautions

    assert cautions(linear_drag_sway=-1.0) == ("linear_drag is -1 in sway: drag that pushes",)
    assert cautions(quadratic_drag_yaw=-0.5) == ("quadratic_drag is -0.5 in yaw: drag that pushes",)
    assert cautions(inertia_yaw=-0.1) == ("mass_matrix is -0.1 in yaw: not positive definite",)
    assert cautions(weight_lever_z=-0.1) == ("lever is -0.1 N m along z: the vehicle turns over",)
    # sqrt(17 * 0.28) = 2.18 is the most that surge and pitch can share.
    (text,) = cautions(mass_lever_z=2.5)
    assert text.startswith("mass_matrix is not positive definite: smallest eigenvalue -0.14")
