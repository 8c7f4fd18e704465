#include "callable.hpp"

namespace tandem::python {
namespace {

std::shared_ptr<Callable> make_callable(py::object function, std::uintptr_t pointer, const std::string& name, int dim,
                                        const std::string& jacobian, bool batched, const py::tuple& data,
                                        std::size_t count, const Numbers& numbers, py::object owner) {
  auto f = std::make_shared<Callable>();
  f->function = std::move(function);
  f->pointer = reinterpret_cast<Callable::Pointer>(pointer);
  f->name = name;
  f->dim = dim;
  f->jacobians = jacobian == "given"     ? Jacobians::given
                 : jacobian == "complex" ? Jacobians::complex_step
                                         : Jacobians::differences;
  f->batched = batched;
  f->data = data;
  f->count = count;
  f->numbers.assign(numbers.data(), numbers.data() + numbers.size());
  f->numbers_each = count ? f->numbers.size() / count : 0;
  f->owner = std::move(owner);
  return f;
}

}  // namespace

Callable::~Callable() {
  if (!Py_IsInitialized()) {  // the problem outlives the interpreter
    function.release();
    data.release();
    owner.release();
    return;
  }
  const py::gil_scoped_acquire lock;
  function = py::object();
  data = py::tuple();
  owner = py::object();
}

void bind_callable(py::module_& m) {
  py::class_<Callable, std::shared_ptr<Callable>> c(
      m, "PythonResidual", "A residual of your own; made by tandem.residual and tandem.compiled_residual.");
  c.def(py::init(&make_callable), py::kw_only(), py::arg("function"), py::arg("pointer"), py::arg("name"),
        py::arg("dim"), py::arg("jacobian"), py::arg("batched"), py::arg("data"), py::arg("count"), py::arg("numbers"),
        py::arg("owner"));
  c.def_readonly("name", &Callable::name);
  c.def_readonly("dim", &Callable::dim);
  c.def_readonly("function", &Callable::function);
  c.def(py::pickle(
      [](const Callable& f) {
        const char* const jacobian = f.jacobians == Jacobians::given          ? "given"
                                     : f.jacobians == Jacobians::complex_step ? "complex"
                                                                              : "difference";
        const py::object reference = py::module_::import("tandem.own").attr("_reference")(f.name, f.function);
        return py::make_tuple(reference, f.name, f.dim, jacobian, f.batched, f.data, f.count);
      },
      [](const py::tuple& state) {
        const py::object function = py::module_::import("tandem.own").attr("_function")(state[0]);
        return make_callable(function, 0, state[1].cast<std::string>(), state[2].cast<int>(),
                             state[3].cast<std::string>(), state[4].cast<bool>(), state[5],
                             state[6].cast<std::size_t>(), Numbers(py::ssize_t(0)), function);
      }));
  c.def("__repr__", [](const Callable& f) {
    return "<residual " + f.name + ": " + std::to_string(f.dim) + " rows" +
           (f.pointer   ? ", compiled"
            : f.batched ? ", batched"
                        : "") +
           ">";
  });
}

}  // namespace tandem::python
