#pragma once

#if defined(__x86_64__) && (defined(__GNUC__) || defined(__clang__))
#define TANDEM_DISPATCHES 1
#endif

/// Forces inlining of functions and lambdas (after their parameter list) that run within dispatch_simd(). Only code
/// that is inlined there is compiled for the wider vectors.
#define TANDEM_INLINED [[gnu::always_inline]] inline
#define TANDEM_INLINED_HERE __attribute__((always_inline))

namespace tandem::detail {

/// Instruction sets that the inner loops are compiled for. Vectors of each set are twice as wide as those of the
/// previous one.
enum class InstructionSet { baseline, avx2, avx512 };

/// Returns the best instruction set of this processor. The environment variable TANDEM_INSTRUCTION_SET=baseline or avx2
/// selects a lower one. Results differ between sets by rounding and are reproducible within one set.
InstructionSet instruction_set();

#ifdef TANDEM_DISPATCHES
template <class F>
[[gnu::target("avx2,fma")]] auto run_avx2(F& f) {
  return f();
}
template <class F>
[[gnu::target("avx512f,avx512dq,avx512vl,avx2,fma")]] auto run_avx512(F& f) {
  return f();
}
#endif

/// Calls f() as compiled for the best instruction set of this processor. `f` and everything that it calls must be
/// inlined.
template <class F>
auto dispatch_simd(F f) {
#ifdef TANDEM_DISPATCHES
  const InstructionSet best = instruction_set();
  if (best == InstructionSet::avx512) return run_avx512(f);
  if (best == InstructionSet::avx2) return run_avx2(f);
#endif
  return f();
}

}  // namespace tandem::detail
