"""Groups: one element and arrays of elements."""

import copy
import pickle

import numpy as np
import pytest

import tandem
from tandem import R1, R2, R3, R6, SE2, SE3, SE23, SO2, SO3

GROUPS = [SO2, SE2, SO3, SE3, SE23, R1, R2, R3, R6]


@pytest.fixture(params=GROUPS, ids=lambda g: g.__name__)
def group(request):
    return request.param


def tangents(group, n=20):
    return np.random.default_rng(1).normal(scale=0.7, size=(n, group.dof))


def test_exp_and_log_are_inverse(group):
    v = tangents(group)
    assert np.allclose(group.exp(v).log(), v, atol=1e-12)


def test_array_equals_its_elements(group):
    v = tangents(group)
    x = group.exp(v)
    assert len(x) == len(v)
    for i in range(len(v)):
        assert np.array_equal(x[i].log(), group.exp(v[i]).log())
        assert np.array_equal(x.adjoint()[i], x[i].adjoint())


def test_inverse_cancels(group):
    x = group.exp(tangents(group))
    assert np.allclose((x @ x.inverse()).log(), 0, atol=1e-12)


def test_jacobians_match_differences(group):
    v, h = tangents(group, 5), 1e-6
    for k in range(group.dof):
        step = np.zeros(group.dof)
        step[k] = h
        ahead, behind = group.exp(v + step), group.exp(v - step)
        assert np.allclose(ahead.minus(behind) / (2 * h), group.jr(v)[:, :, k], atol=1e-8)
    assert np.allclose(group.jr(v) @ group.jr_inv(v), np.eye(group.dof), atol=1e-10)
    assert np.allclose(group.jl(v) @ group.jl_inv(v), np.eye(group.dof), atol=1e-10)


def point_dim(group):
    return group.identity().matrix().shape[0] - 1 if group not in (SO3, SO2, SE23) else {SO2: 2}.get(group, 3)


def test_functions_return_their_jacobians(group):
    rng, h, n = np.random.default_rng(2), 1e-6, 4
    v, x = tangents(group, n), group.exp(tangents(group, 2 * n)[n:])
    points = rng.normal(size=(n, point_dim(group)))

    def difference(a, b):
        return (a.minus(b) if isinstance(a, group) else a - b) / (2 * h)

    functions = [(group.exp, (v,)), (lambda y, **k: y.log(**k), (x,)), (lambda y, **k: y.inverse(**k), (x,)),
                 (lambda y, d, **k: y.plus(d, **k), (x, v)), (lambda y, p, **k: y.act(p, **k), (x, points)),
                 (lambda y, p, **k: y.act(p, **k), (x[0], points)), (lambda y, d, **k: y.plus(d, **k), (x, v[0]))]
    for f, arguments in functions:
        value, *jacobians = f(*arguments, jacobians=True)
        plain = f(*arguments)
        assert np.array_equal(*[y.log() if isinstance(y, group) else y for y in (value, plain)])
        assert len(jacobians) == len(arguments)
        for s, J in enumerate(jacobians):
            for k in range(J.shape[-1]):
                step = h * np.eye(J.shape[-1])[k]

                def moved(sign):
                    a = arguments[s]
                    return a.plus(sign * step) if isinstance(a, group) else a + sign * step

                ends = [f(*arguments[:s], moved(sign), *arguments[s + 1:]) for sign in (1, -1)]
                assert np.allclose(difference(*ends), J[..., k], atol=1e-7), (s, k)
    single, by_x, by_point = x[1].act(points[2], jacobians=True)
    assert single.shape == points[2].shape and by_x.shape == (len(single), group.dof)
    assert by_point.shape == (len(single), len(single))


def test_adjoint_moves_perturbations_to_the_left(group):
    x, d = group.exp(tangents(group, 1)[0]), tangents(group, 1)[0] * 0.1
    assert np.allclose((x @ group.exp(d)).log(), (group.exp(x.adjoint() @ d) @ x).log(), atol=1e-12)


def test_interpolation_has_the_ends_and_its_jacobians(group):
    x, y = group.exp(tangents(group, 1)[0]), group.exp(tangents(group, 2)[1])
    assert np.allclose(x.interpolate(y, 0.0).minus(x), 0, atol=1e-12)
    assert np.allclose(x.interpolate(y, 1.0).minus(y), 0, atol=1e-12)
    z, by_x, by_y = x.interpolate(y, 0.3, jacobians=True)
    h = 1e-6
    for k in range(group.dof):
        d = np.zeros(group.dof)
        d[k] = h
        numeric = x.plus(d).interpolate(y, 0.3).minus(x.plus(-d).interpolate(y, 0.3)) / (2 * h)
        assert np.allclose(numeric, by_x[:, k], atol=1e-7)
        numeric = x.interpolate(y.plus(d), 0.3).minus(x.interpolate(y.plus(-d), 0.3)) / (2 * h)
        assert np.allclose(numeric, by_y[:, k], atol=1e-7)


def test_copy_and_pickle_are_exact(group):
    x = group.exp(tangents(group))
    for y in (copy.copy(x), copy.deepcopy(x), pickle.loads(pickle.dumps(x))):
        assert np.array_equal(y.matrix(), x.matrix())
    assert np.array_equal(pickle.loads(pickle.dumps(x[0])).matrix(), x[0].matrix())


def test_wrong_shapes_name_the_shape_wanted(group):
    with pytest.raises(ValueError, match=rf"{group.__name__}\.exp: expected an array of shape \({group.dof},"):
        group.exp(np.zeros(group.dof + 1))
    with pytest.raises(ValueError, match="shape"):
        group.exp(np.zeros((2, 2, group.dof)))


@pytest.mark.parametrize("bad", [np.full(6, np.nan), ["a"] * 6, np.zeros(6, complex), None, [object()] * 6])
def test_entries_that_are_not_numbers_are_rejected(bad):
    with pytest.raises(ValueError):
        SE3.exp(bad)


def test_integers_strides_and_order_are_accepted():
    v = tangents(SE3, 10)
    assert np.array_equal(SE3.exp(np.asfortranarray(v)).log(), SE3.exp(v).log())
    assert np.array_equal(SE3.exp(v[::2]).log(), SE3.exp(v[::2].copy()).log())
    assert np.array_equal(SE3.exp(np.arange(6)).log(), SE3.exp(np.arange(6.0)).log())
    assert np.allclose(SE3.exp(v.astype(np.float32)).log(), v, atol=1e-6)


def test_outputs_own_their_memory():
    x = SE3.exp(np.ones(6))
    matrix = x.matrix()
    matrix[:] = 0
    assert not np.array_equal(x.matrix(), matrix)
    del x
    assert matrix.flags.owndata or matrix.base is not None


def test_scipy_rotations_are_accepted():
    Rotation = pytest.importorskip("scipy.spatial.transform").Rotation
    r = Rotation.from_euler("zyx", [[0.3, 0.2, 0.1], [1, 2, 3]])
    assert np.allclose(SO3(r).matrix(), r.as_matrix())
    assert np.allclose(SE3(r, np.zeros((2, 3))).matrix()[:, :3, :3], r.as_matrix())


def test_quaternion_order_is_named():
    x = SO3.exp([0.1, 0.2, 0.3])
    assert np.allclose(SO3.from_quaternion(x.quaternion(order="wxyz"), order="wxyz").minus(x), 0)
    with pytest.raises(TypeError):
        SO3.from_quaternion(x.quaternion())
    with pytest.raises(ValueError, match="xyzw"):
        SO3.from_quaternion(x.quaternion(), order="zyxw")
    with pytest.raises(ValueError, match="norm"):
        SO3.from_quaternion([0, 0, 0, 2], order="xyzw")


def test_matrices_that_are_no_rotations_are_rejected():
    with pytest.raises(ValueError, match="rotation"):
        SE3.from_matrix(2 * np.eye(4))
    with pytest.raises(ValueError, match="rotation"):
        SO3(np.diag([1.0, 1, -1]))


def test_a_hundred_thousand_elements_are_one_call():
    x = SE3.exp(np.zeros((100000, 6)))
    assert len(x) == 100000 and x.log().shape == (100000, 6)


def test_lengths_that_differ_are_an_error():
    with pytest.raises(ValueError, match="2 and 3"):
        SE3.identity(2) @ SE3.identity(3)


def test_vectors_of_any_length():
    assert np.array_equal(tandem.Rn([1.0, 2, 3]).vector, [1, 2, 3])
    with pytest.raises(ValueError, match="7"):
        tandem.Rn(np.zeros(7))


def test_actions_on_points():
    x = SE3.exp(tangents(SE3, 4))
    points = np.random.default_rng(2).normal(size=(4, 3))
    expected = np.einsum("nij,nj->ni", x.matrix(), np.column_stack([points, np.ones(4)]))[:, :3]
    assert np.allclose(x.act(points), expected)


def test_arrays_are_indexed_as_in_numpy():
    x = SE3.exp(np.arange(24.0).reshape(4, 6) / 20)
    variables = tandem.Problem().add(x, "x")
    numbers = np.arange(4)
    for index in (1, -1, np.int64(2), np.array(3), slice(1, None, 2), [0, 2], [-1, 0], np.array([], dtype=int), [],
                  np.array([False, False, True, True]), [True, False, False, True], np.zeros(4, dtype=bool)):
        expected = numbers[np.array([], dtype=int) if isinstance(index, list) and not index else index]
        part, handles = x[index], variables[index]
        if np.ndim(expected) == 0:
            assert np.array_equal(part.log(), x[int(expected)].log()) and handles.name == f"x {expected}"
        else:
            assert np.array_equal(part.log(), x.log()[expected])
            assert [h.name for h in handles] == [f"x {i}" for i in expected]
    for wrong, error in ((0.7, TypeError), ([0.7], TypeError), (np.array([1.0]), TypeError), ("a", TypeError),
                         (None, TypeError), (True, TypeError), ([[0, 1]], TypeError), (4, IndexError),
                         ([0, 4], IndexError), ([-5], IndexError), ([True, False], IndexError)):
        for array in (x, variables):
            with pytest.raises(error) as caught:
                array[wrong]
            assert "\n" not in str(caught.value)


@pytest.mark.parametrize("call, message", [
    (lambda: SE3.from_matrix(np.diag([1.0, 1, 1, 2])), "last row"),
    (lambda: SE2.from_matrix(np.array([[1.0, 0, 0], [0, 1, 0], [1, 0, 1]])), "last row"),
    (lambda: SE3().interpolate(SE3(), np.nan), "NaN"),
    (lambda: tandem.Range(np.nan), "Range: range"),
    (lambda: tandem.Range("a"), "Range: range"),
    (lambda: tandem.Range(-1.0), "negative"),
    (lambda: tandem.Range(np.inf), "finite"),
    (lambda: tandem.TwistComponents(0.0, "sway"), "dt: a time step must be positive"),
    (lambda: tandem.Prior("a"), "Prior: z: expected"),
    (lambda: tandem.between(2, 1), "between: no number"),
    (lambda: tandem.between([0, 0], [1, 1, 1]), "2 lower and 3 upper"),
    (lambda: tandem.at_most(np.inf), "at_most"),
    (lambda: tandem.equal_to(np.inf), "equal_to"),
])
def test_values_are_checked_at_once(call, message):
    with pytest.raises(ValueError, match=message) as error:
        call()
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("call, message", [
    (lambda: tandem.FixedLag(5), r"^FixedLag: expected FixedLag\(option=value, \.\.\.\), not \(int\)"),
    (lambda: tandem.Gaussian(1, 2, 3), r"^Gaussian: expected Gaussian\(sigmas\), not \(int, int, int\)"),
    (lambda: tandem.Problem().minimize(tandem.Prior(R3([0, 0, 0])), 1.0, None, None, None),
     r"^minimize: expected minimize\(residual, noise, x, loss=None\)"),
    (lambda: tandem.Problem().value(), "^value: expected value"),
    (lambda: SE3.identity("a"), "^identity: expected identity"),
    (lambda: tandem.Huber("a"), "^Huber: expected Huber"),
    (lambda: SE3(1, 2, 3, 4), r"^SE3: expected SE3\("),
])
def test_calls_with_wrong_arguments_are_one_sentence(call, message):
    with pytest.raises(TypeError, match=message) as error:
        call()
    assert "\n" not in str(error.value) and "incompatible" not in str(error.value)
