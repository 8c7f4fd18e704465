#include <tandem/solvers/online/online_estimator.hpp>
#include <tandem/solvers/option_fields.hpp>
#include <tandem/studies/commands/problem_options.hpp>
#include <tandem/studies/navigation/navigated_scenario.hpp>
#include <tandem/studies/scenario/sensor_rows.hpp>

#include "exclusive.hpp"
#include "interrupt.hpp"
#include "options.hpp"
#include "problem_object.hpp"
#include "python_error.hpp"
#include "summary.hpp"

namespace tandem::python {
namespace {

/// An online estimator with the settings of its scenario, which convert rows to measurements.
class PyOnlineEstimator {
 public:
  PyOnlineEstimator(const std::string& folder, const std::vector<std::string>& words, const py::dict& given)
      : PyOnlineEstimator(checked_input([&] { return apply_words(words, read_settings(folder, RowsIn::stream)); }),
                          given) {}

  /// Returns f(estimator), computed without the interpreter's lock.
  template <class F>
  auto change(F f) {
    return exclusive_.run([&] {
      std::atomic<bool> stop = false;  // an update is too short to be stopped; the exit waits for it
      return run_unlocked(stop, [&] { return f(*estimator_); });
    });
  }
  template <class F>
  auto use(F f) {
    return exclusive_.run([&] { return f(*estimator_); });
  }
  /// Returns f(estimator). Throws BadInputError if there is no estimate yet.
  template <class F>
  auto read(F f) {
    return exclusive_.run([&] {
      if (!estimator_->started())
        throw BadInputError("OnlineEstimator: there is no estimate yet; add measurements until `started` is True");
      return f(*estimator_);
    });
  }
  /// Adds a measurement, a row of the sensor's CSV file. Returns why it is rejected, or an empty text.
  std::string add(const std::string& sensor, py::handle row) {
    const Sensor& s = find(sensor);
    const Batch values = batch(row, {s.columns}, sensor + ": " + s.names);
    if (!values.single) throw py::value_error(sensor + ": expected one row: " + s.names);
    const Frame& frame = scenario_.frame;
    const bool planar = scenario_.data.planar;
    const double* x = values.data();
    const auto is_missing = [&](const std::vector<double>& markers) {
      return tandem::is_missing({x + 1, std::size_t(s.columns) - 1}, markers);
    };
    const std::string missing = "the row stands for missing data";
    const auto text = [](const std::optional<Rejection>& why) { return why ? why->text : std::string(); };
    return checked_input([&] {
      return change([&](OnlineEstimator& e) -> std::string {
        if (s.kind == Kind::odometry)
          return is_missing_pose(x) ? missing : text(e.add_odometry(world_pose(x, frame, planar)));
        if (s.kind == Kind::target) {
          const TargetSensor& of = scenario_.data.sensors[s.index];
          if (is_missing(of.missing)) return missing;
          return text(e.add_target(s.index, target_measurement(of.type, x, frame, planar, of.missing)));
        }
        if (s.kind == Kind::ego) {
          const EgoSensor& of = scenario_.navigation->sensors[s.index];
          if (is_missing(of.missing)) return missing;
          return text(e.add_ego(s.index, ego_measurement(of.type, x, frame, of.missing)));
        }
        const ImuSensor& imu = *scenario_.navigation->imu;
        if (is_missing(imu.missing)) return missing;
        ImuSample sample = imu_sample(x, frame, imu.missing);
        sample.t -= imu.delay;
        return text(e.add_imu(sample));
      });
    });
  }

  const Frame& frame() const { return scenario_.frame; }
  bool planar() const { return scenario_.data.planar; }

  /// Return the updates, and the rejected measurements, since the last call.
  py::list take_updates() {
    py::list list;
    for (const OnlineUpdate& u : exclusive_.run([&] { return std::exchange(updates_, {}); }))
      list.append(py::dict(py::arg("t") = u.t, py::arg("new_keyframe") = u.new_keyframe, py::arg("seconds") = u.seconds,
                           py::arg("summary") = PySummary(u.summary)));
    return list;
  }
  std::vector<std::pair<std::string, std::string>> take_rejected() {
    return exclusive_.run([&] { return std::exchange(rejected_, {}); });
  }
  py::list sensors() const {
    py::list all;
    for (const auto& [name, sensor] : sensors_) all.append(py::make_tuple(name, sensor.names));
    return all;
  }

 private:
  enum class Kind { odometry, imu, ego, target };
  struct Sensor {
    Kind kind;
    std::size_t index;
    std::string names;  // names of the columns, separated by commas
    int columns;
  };

  PyOnlineEstimator(ProblemOfWords problem, const py::dict& given) : scenario_(std::move(problem.scenario)) {
    const bool by_odometry = moves_by_odometry(scenario_);
    OnlineOptions o;
    o.lag.max_iterations = 12;  // default of `tandem track`
    o.tracking = problem.target;
    o.ego = problem.own.ego;
    o.alignment = problem.own.alignment;
    read_options(o, given);
    estimator_ =
        std::make_unique<OnlineEstimator>(scenario_.data, by_odometry ? std::nullopt : scenario_.navigation, o);
    estimator_->on_update = [this](const OnlineUpdate& update) { updates_.push_back(update); };
    estimator_->on_reject = [this](const std::string& sensor, const Rejection& why) {
      rejected_.emplace_back(sensor, why.text);
    };
    const auto add = [&](const std::string& name, Kind kind, std::size_t index, const std::string& names) {
      sensors_.emplace_back(name, Sensor{kind, index, names, 1 + int(std::count(names.begin(), names.end(), ','))});
    };
    if (by_odometry) {
      add("odometry", Kind::odometry, 0, pose_columns);
    } else if (scenario_.navigation) {
      if (scenario_.navigation->imu) add(scenario_.navigation->imu->name, Kind::imu, 0, imu_columns);
      const std::vector<EgoSensor>& own = scenario_.navigation->sensors;
      for (std::size_t i = 0; i < own.size(); ++i) add(own[i].name, Kind::ego, i, columns(own[i].type));
    }
    const std::vector<TargetSensor>& target = scenario_.data.sensors;
    for (std::size_t i = 0; i < target.size(); ++i)
      add(target[i].name, Kind::target, i, columns(target[i].type, scenario_.data.planar));
  }

  static void read_options(OnlineOptions& o, const py::dict& given) {
    Options read("OnlineEstimator", given);
    read("window", o.lag.window);
    read("window_keyframes", o.lag.max_keyframes);
    read("max_iterations", o.lag.max_iterations);
    read("cost_tolerance", o.lag.cost_tolerance);
    read("threads", o.lag.threads);
    read("gate", o.reset.gate);
    read("reset_after", o.reset.reset_after);
    read("max_gap", o.reset.max_gap);
    read("unconverged_after", o.reset.unconverged_after);
    read("lost_after", o.reset.lost_after);
    read("invalid_after", o.reset.invalid_after);
    read("soften", o.soften_infeasible);
    constexpr NamedValue<bool> kNewest[] = {{"hypotheses", true}, {"window", false}};
    read("newest", o.hypotheses, kNewest);
    read.finish();
  }

  const Sensor& find(const std::string& name) const {
    std::string known;
    for (const auto& [of, sensor] : sensors_) {
      if (of == name) return sensor;
      known += (known.empty() ? "" : ", ") + of;
    }
    throw BadInputError("OnlineEstimator: there is no sensor " + name + "; there are " + known);
  }

  Scenario scenario_;
  std::vector<std::pair<std::string, Sensor>> sensors_;
  std::unique_ptr<OnlineEstimator> estimator_;
  std::vector<OnlineUpdate> updates_;
  std::vector<std::pair<std::string, std::string>> rejected_;
  Exclusive exclusive_{"estimator"};
};

py::object py_pose(const Frame& frame, const SE3& pose) { return py::cast(Elements<SE3>{{frame.world(pose)}, true}); }

/// Returns a pose, a position if no orientation is estimated, or None.
py::object py_target(const Frame& frame, const std::optional<TargetState>& target) {
  if (!target) return py::none();
  if (!target->rotation) return py::cast(frame.world(target->position));
  return py_pose(frame, SE3(*target->rotation, target->position));
}

py::object py_relative(const Frame& frame, const std::optional<RelativeTarget>& target) {
  if (!target) return py::none();
  const Matrix<3, 3> A = frame.body_axes();
  py::object covariance = py::none();
  if (target->covariance) covariance = py::cast(Matrix<3, 3>(A * *target->covariance * A.transpose()));
  return py::make_tuple(frame.body(target->position), covariance);
}

/// Returns a covariance of a pose, or of a point in the world, in the axes of the scenario.
Eigen::MatrixXd turned(const Frame& frame, const Eigen::MatrixXd& S, bool planar, bool point) {
  const Eigen::Index n = S.rows();
  Eigen::MatrixXd A = Eigen::MatrixXd::Identity(n, n);
  if (point) {
    A = frame.world_axes().topLeftCorner(n, n);
  } else if (planar) {
    A = Vector<3>(1, frame.angle(1), frame.angle(1)).asDiagonal();
  } else {
    for (Eigen::Index i = 0; i < n; i += 3) A.block<3, 3>(i, i) = frame.body_axes();
  }
  return A * S * A.transpose();
}

py::dict health_of(const OnlineEstimator& e) {
  const TrackHealth& h = e.health();
  const auto output = [](const OutputHealth& o) {
    return py::dict(py::arg("state") = std::string(name(o.state)), py::arg("age") = o.age);
  };
  py::dict sensors;
  for (const SensorHealth& s : h.sensors)
    sensors[py::str(s.name)] =
        py::dict(py::arg("used") = s.used, py::arg("rejected") = s.rejected, py::arg("sigmas") = s.sigmas);
  return py::dict(py::arg("chaser") = output(h.chaser), py::arg("target") = output(h.target),
                  py::arg("sensors") = sensors, py::arg("resets") = h.resets, py::arg("suspensions") = h.suspensions,
                  py::arg("converged") = h.converged);
}

}  // namespace

void bind_online(py::module_& m) {
  using E = PyOnlineEstimator;
  py::class_<E> c(m, "OnlineEstimator", "Compiled part of tandem.OnlineEstimator, which documents it.");
  c.def(py::init<const std::string&, const std::vector<std::string>&, const py::dict&>(), py::arg("folder"),
        py::arg("words"), py::arg("options"));
  c.def("add", &E::add, py::arg("sensor"), py::arg("row"));
  c.def("finish", [](E& x) { x.change([](OnlineEstimator& e) { e.finish(); }); });
  c.def("reset", [](E& x) { x.change([](OnlineEstimator& e) { e.reset(); }); });
  c.def("solve_to_convergence", [](E& x) {
    x.read([](OnlineEstimator&) {});
    return x.change([](OnlineEstimator& e) { return PySummary(e.solve_to_convergence()); });
  });
  c.def("updates", &E::take_updates);
  c.def("rejected", &E::take_rejected);
  c.def_property_readonly("sensors", &E::sensors);
  c.def_property_readonly("started", [](E& x) { return x.use([](OnlineEstimator& e) { return e.started(); }); });
  c.def_property_readonly("has_target", [](E& x) { return x.use([](OnlineEstimator& e) { return e.has_target(); }); });
  c.def_property_readonly("health", [](E& x) { return x.use([](OnlineEstimator& e) { return health_of(e); }); });
  c.def_property_readonly("newest", [](E& x) { return x.read([](OnlineEstimator& e) { return e.newest(); }); });
  c.def_property_readonly("oldest", [](E& x) { return x.read([](OnlineEstimator& e) { return e.oldest(); }); });
  c.def_property_readonly("keyframes", [](E& x) { return x.read([](OnlineEstimator& e) { return e.keyframes(); }); });
  c.def_property_readonly("cost", [](E& x) { return x.read([](OnlineEstimator& e) { return e.cost(); }); });
  c.def_property_readonly(
      "chaser", [](E& x) { return x.read([&](OnlineEstimator& e) { return py_pose(x.frame(), e.chaser().pose); }); });
  c.def_property_readonly("velocity", [](E& x) {
    return x.read([&](OnlineEstimator& e) { return x.frame().world(e.chaser().velocity); });
  });
  c.def_property_readonly(
      "target", [](E& x) { return x.read([&](OnlineEstimator& e) { return py_target(x.frame(), e.target()); }); });
  c.def_property_readonly("target_velocity", [](E& x) {
    return x.read([&](OnlineEstimator& e) -> py::object {
      const auto velocity = e.target_velocity();
      return velocity ? py::cast(x.frame().world(*velocity)) : py::none();
    });
  });
  const auto ahead = [](double h) {
    if (!std::isfinite(h)) throw BadInputError("OnlineEstimator: the prediction time is not finite");
    return h;
  };
  c.def(
      "predicted_chaser",
      [ahead](E& x, double h) {
        return x.read([&](OnlineEstimator& e) { return py_pose(x.frame(), e.predicted_chaser(ahead(h))); });
      },
      py::arg("h"));
  c.def(
      "predicted_target",
      [ahead](E& x, double h) {
        return x.read([&](OnlineEstimator& e) { return py_target(x.frame(), e.predicted_target(ahead(h))); });
      },
      py::arg("h"));
  c.def(
      "relative_target",
      [ahead](E& x, double h) {
        return x.read([&](OnlineEstimator& e) { return py_relative(x.frame(), e.relative_target(ahead(h))); });
      },
      py::arg("h"));
  c.def("covariance", [](E& x) {
    return x.read([&](OnlineEstimator& e) {
      const OnlineEstimator::Covariance S = e.covariance();
      py::dict all(py::arg("chaser") = turned(x.frame(), S.chaser, x.planar(), false));
      if (S.target.size() == 0) return all;
      const auto target = e.target();
      const bool point = S.target.rows() < S.chaser.rows() || !target || !target->rotation;
      all["target"] = turned(x.frame(), S.target, x.planar(), point);
      return all;
    });
  });
  c.def("window", [](E& x) {
    return x.read([&](OnlineEstimator& e) {
      std::vector<double> t;
      Elements<SE3> poses{{}, false};
      for (const Stamped<EgoState>& state : e.window()) {
        t.push_back(state.t);
        poses.x.push_back(x.frame().world(state.value.pose));
      }
      return py::make_tuple(py::array_t<double>(py::ssize_t(t.size()), t.data()), std::move(poses));
    });
  });
}

}  // namespace tandem::python
