#include <tandem/lie/sek3.hpp>

namespace tandem {

template class BasicSEK3<1, double>;
template class BasicSEK3<2, double>;

}  // namespace tandem
