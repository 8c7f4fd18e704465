#include <tandem/problem/tracking/tracking_triples.hpp>

namespace tandem::detail {

template void TrackingBuild<SE2>::add_triples(std::size_t);

}  // namespace tandem::detail
