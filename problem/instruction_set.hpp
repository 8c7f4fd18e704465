#pragma once

#if defined(__x86_64__) && (defined(__GNUC__) || defined(__clang__))
#define TANDEM_DISPATCHES 1
#endif

/// What runs by at_best() has to be inlined there, whatever the compiler would do: only then is it compiled for wider vectors.
/// Functions, and lambdas behind their parameters.
#define TANDEM_INLINED [[gnu::always_inline]] inline
#define TANDEM_INLINED_HERE __attribute__((always_inline))

namespace tandem::detail {

/// Of those for which the inner loops are compiled: each vector of doubles twice as wide as the one before.
enum class InstructionSet { baseline, avx2, avx512 };

/// The best that this processor has. TANDEM_INSTRUCTION_SET=baseline (or avx2) in the environment asks for less: sums are
/// rounded otherwise by another set, and always alike by one.
InstructionSet instruction_set();

#ifdef TANDEM_DISPATCHES
template <class F>
[[gnu::target("avx2,fma")]] auto at_avx2(F& f) {
  return f();
}
template <class F>
[[gnu::target("avx512f,avx512dq,avx512vl,avx2,fma")]] auto at_avx512(F& f) {
  return f();
}
#endif

/// f(), compiled for each instruction set, by the one that this processor has. `f` is a lambda that is inlined, and so is what
/// it calls.
template <class F>
auto at_best(F f) {
#ifdef TANDEM_DISPATCHES
  const InstructionSet best = instruction_set();
  if (best == InstructionSet::avx512) return at_avx512(f);
  if (best == InstructionSet::avx2) return at_avx2(f);
#endif
  return f();
}

}  // namespace tandem::detail
