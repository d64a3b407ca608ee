"""A model that knows where it is not to be believed says so beside the results of a run."""

import equinox as eqx
import numpy as np
import pytest

import gainful as gf
from gainful.faults import actuator_offset, with_faults
from gainful.plants import RigidSpacecraft, SlewTarget, attitude_form, spacecraft_model

DEGREE = np.pi / 180.0  # rad
TARGET = SlewTarget(slope=np.array([2.0, 0.0, 0.0]) * DEGREE)


def states_at(form, *phi_deg):
    model = spacecraft_model(RigidSpacecraft(form=attitude_form(form, TARGET)))
    x = np.zeros((len(phi_deg), model.space.size))
    x[:, 3] = np.asarray(phi_deg) * DEGREE
    return model, x


@pytest.mark.parametrize("form", ["target", "orbit"])
@pytest.mark.parametrize("phi", [85.1, -88.0, 92.0, 269.0])
def test_angles_within_five_degrees_of_their_singularity_are_told_with_the_cure(form, phi):
    model, x = states_at(form, 0.0, phi, 84.9)
    (text,) = model.cautions(x)
    assert text.startswith(f"phi comes within {abs(abs(phi) % 180 - 90):.2g} degrees of 90")
    assert "in 1 of 3 rows; write the attitude as a quaternion" in text


def test_nothing_is_told_of_other_angles_of_missing_ones_and_of_quaternions():
    model, x = states_at("orbit", 0.0, 84.9, -84.9, 180.0, np.nan)
    assert model.cautions(x) == ()
    model, x = states_at("quaternion", 90.0)
    assert model.cautions(x) == ()


def test_a_model_with_faults_tells_what_the_model_without_them_does():
    model, x = states_at("orbit", 89.0)
    extended = with_faults(model, [actuator_offset("torque_x")])
    assert extended.cautions(np.append(x, np.full((1, 1), 1.5), axis=1)) == model.cautions(x) != ()


def stays(x, u, t):
    return x


class Walk(eqx.Module):
    """A state that stays, and a word about where it stays."""

    def __call__(self, x, u, t):
        return x

    def cautions(self, x):
        return (f"{(x > 1).sum()} rows above 1",)


def test_a_run_warns_of_what_its_model_knows_of_the_estimates():
    model = gf.discrete_model(Walk(), stays, states=["x"], outputs=["y"], Q=1.0, R=1e-6)
    log = gf.make_log(model, [0.0, 1.0, 2.0], [0.5, 2.0, 3.0])
    result = gf.run(gf.kalman_filter(), model, gf.make_prior(model, [0.0], [1.0]), log)
    assert result.warnings == ("2 rows above 1",)
