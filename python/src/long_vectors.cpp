#include "bind_vector.hpp"

namespace tandem::python {

void bind_long_vectors(py::module_& m) {
  bind_vector<5>(m);
  bind_vector<6>(m);
  bind_vector<8>(m);
  bind_vector<9>(m);
  bind_vector<12>(m);
}

}  // namespace tandem::python
