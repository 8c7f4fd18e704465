#include <cstdlib>
#include <string_view>

#include <tandem/problem/instruction_set.hpp>

namespace tandem::detail {
namespace {

InstructionSet find() {
#ifdef TANDEM_DISPATCHES
  const char* selected = std::getenv("TANDEM_INSTRUCTION_SET");
  const std::string_view most = selected ? selected : "avx512";
  if (most == "baseline" || !__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma"))
    return InstructionSet::baseline;
  if (most == "avx2" || !__builtin_cpu_supports("avx512f") || !__builtin_cpu_supports("avx512dq") ||
      !__builtin_cpu_supports("avx512vl"))
    return InstructionSet::avx2;
  return InstructionSet::avx512;
#else
  return InstructionSet::baseline;
#endif
}

}  // namespace

InstructionSet instruction_set() {
  static const InstructionSet best = find();
  return best;
}

}  // namespace tandem::detail
