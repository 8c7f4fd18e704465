#include "bind_vector.hpp"

namespace tandem::python {

void bind_vectors(py::module_& m) {
  bind_vector<1>(m);
  bind_vector<2>(m);
  bind_vector<3>(m);
  bind_vector<4>(m);
}

}  // namespace tandem::python
