#include <utility>

#include <tandem/lie/error.hpp>
#include <tandem/problem/pool.hpp>
#include <tandem/problem/stop.hpp>

namespace tandem::detail {

void rethrow_undefined(std::string_view residual, std::span<const StateStoreBase* const> stores, const int* slots) {
  try {
    throw;
  } catch (const StaleHandleError&) {
    throw;
  } catch (const Stopped&) {
    throw;
  } catch (const Error& error) {
    std::vector<std::string> names;
    for (std::size_t s = 0; s < stores.size(); ++s) names.push_back(*stores[s]->name[std::size_t(slots[s])]);
    throw UndefinedResidualError(std::string(residual), std::move(names), error.what());
  }
}

}  // namespace tandem::detail
