#include <tandem/problem/state_store.hpp>

namespace tandem::detail {

template class StateStore<SE3>;
template class StateStore<SE2>;
template class StateStore<SO3>;
template class StateStore<SO2>;
template class StateStore<Rn<1>>;
template class StateStore<Rn<2>>;
template class StateStore<Rn<3>>;
template class StateStore<Rn<6>>;

}  // namespace tandem::detail
