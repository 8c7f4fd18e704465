#pragma once

#include <algorithm>
#include <array>
#include <concepts>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <type_traits>
#include <typeinfo>
#include <utility>
#include <vector>

#include <tandem/lie/bundle.hpp>
#include <tandem/lie/rn.hpp>
#include <tandem/lie/se2.hpp>
#include <tandem/lie/sek3.hpp>

namespace tandem {

/// Sequence of the numbers in a residual or a group, for writing it to a file and reading it back bitwise equal. One
/// function, pass_fields, visits the members of a type in both directions.
class Fields {
 public:
  /// Collects the numbers of the visited members.
  Fields() = default;
  /// Assigns these numbers to the visited members.
  explicit Fields(std::span<const double> given) : given_(given), reads_(true) {}

  bool reads() const { return reads_; }
  /// Returns the collected numbers.
  const std::vector<double>& values() const { return values_; }
  /// Returns how many numbers the members have; may exceed the number of given ones.
  std::size_t count() const { return count_; }
  /// Returns true if every member is supported and the given numbers fit exactly.
  bool complete() const { return error_.empty() && (!reads_ || count_ == given_.size()); }
  /// Returns the reason why a member or its number is not supported (part of a sentence), or an empty string.
  const std::string& error() const { return error_; }

  void pass(double* x, std::size_t n);
  /// Passes an integer in [lowest, highest].
  void pass_integer(double& x, double lowest, double highest);
  void fail(std::string why);
  void fail(const std::type_info& type);

 private:
  std::span<const double> given_;
  std::vector<double> values_;
  std::size_t count_ = 0;
  bool reads_ = false;
  std::string error_;
};

/// Returns the name of a type in files and messages, for example "tandem::RelativePose<tandem::SE3>".
std::string type_name(const std::type_info& type);

// Groups are stored by their internal numbers, because constructors may normalise and thus change them.
void pass_group(SO2& X, Fields& fields);
void pass_group(SE2& X, Fields& fields);
void pass_group(SO3& X, Fields& fields);
template <int N>
void pass_group(Rn<N>& X, Fields& fields) {
  Vector<N> x = X.vector();
  fields.pass(x.data(), N);
  X = Rn<N>(x);
}
template <int K>
void pass_group(BasicSEK3<K, double>& X, Fields& fields) {
  SO3 R = X.rotation();
  Matrix<3, K> t = X.matrix().template topRightCorner<3, K>();
  pass_group(R, fields);
  fields.pass(t.data(), 3 * K);
  X = {R, t};
}

template <class T>
void pass_fields(T& x, Fields& fields);

template <class... Gs>
void pass_group(Bundle<Gs...>& X, Fields& fields) {
  [&]<int... I>(std::integer_sequence<int, I...>) { (pass_fields(X.template get<I>(), fields), ...); }
  (std::make_integer_sequence<int, int(sizeof...(Gs))>());
}

namespace detail {

template <class T>
inline constexpr bool is_optional = false;
template <class T>
inline constexpr bool is_optional<std::optional<T>> = true;

struct AnyField {
  template <class T>
  operator T() const;
};
template <class T>
struct AnyBase {
  template <class B>
  requires(std::is_base_of_v<B, T> && !std::same_as<B, T>) operator B() const;
};

/// Returns the number of members of an aggregate. Returns kUnknown if T has bases, more than 12 members or members that
/// cannot be value-initialised. Each empty pair of braces initialises one member of any type.
inline constexpr int kUnknown = -1;
template <class T>
consteval int count_fields() {
  if constexpr (!std::is_aggregate_v<T> || std::is_union_v<T> || !std::default_initializable<T>) {
    return kUnknown;
  } else if constexpr (std::is_empty_v<T>) {
    return 0;
  } else if constexpr (requires { T{AnyBase<T>()}; }) {
    return kUnknown;
#define TANDEM_STOPS_AT(n, ...)                                        \
  }                                                                    \
  else if constexpr (!requires { T{__VA_ARGS__ __VA_OPT__(, ){}}; }) { \
    return requires { T{__VA_ARGS__ __VA_OPT__(, ) AnyField()}; }      \
    ? kUnknown : n;
#define TANDEM_4 \
  {}, {}, {}, {}
    TANDEM_STOPS_AT(0)
    TANDEM_STOPS_AT(1, {})
    TANDEM_STOPS_AT(2, {}, {})
    TANDEM_STOPS_AT(3, {}, {}, {})
    TANDEM_STOPS_AT(4, TANDEM_4)
    TANDEM_STOPS_AT(5, TANDEM_4, {})
    TANDEM_STOPS_AT(6, TANDEM_4, {}, {})
    TANDEM_STOPS_AT(7, TANDEM_4, {}, {}, {})
    TANDEM_STOPS_AT(8, TANDEM_4, TANDEM_4)
    TANDEM_STOPS_AT(9, TANDEM_4, TANDEM_4, {})
    TANDEM_STOPS_AT(10, TANDEM_4, TANDEM_4, {}, {})
    TANDEM_STOPS_AT(11, TANDEM_4, TANDEM_4, {}, {}, {})
    TANDEM_STOPS_AT(12, TANDEM_4, TANDEM_4, TANDEM_4)
#undef TANDEM_4
#undef TANDEM_STOPS_AT
  } else {
    return kUnknown;
  }
}

template <class... Ts>
void pass_each(Fields& fields, Ts&... x) {
  (pass_fields(x, fields), ...);
}

template <class T>
void pass_members(T& x, Fields& fields) {
  constexpr int n = count_fields<T>();
#define TANDEM_MEMBERS(n_, ...)     \
  else if constexpr (n == n_) {     \
    auto& [__VA_ARGS__] = x;        \
    pass_each(fields, __VA_ARGS__); \
  }
  if constexpr (n == 0) {
  }
  TANDEM_MEMBERS(1, a)
  TANDEM_MEMBERS(2, a, b)
  TANDEM_MEMBERS(3, a, b, c)
  TANDEM_MEMBERS(4, a, b, c, d)
  TANDEM_MEMBERS(5, a, b, c, d, e)
  TANDEM_MEMBERS(6, a, b, c, d, e, f)
  TANDEM_MEMBERS(7, a, b, c, d, e, f, g)
  TANDEM_MEMBERS(8, a, b, c, d, e, f, g, h)
  TANDEM_MEMBERS(9, a, b, c, d, e, f, g, h, i)
  TANDEM_MEMBERS(10, a, b, c, d, e, f, g, h, i, j)
  TANDEM_MEMBERS(11, a, b, c, d, e, f, g, h, i, j, k)
  TANDEM_MEMBERS(12, a, b, c, d, e, f, g, h, i, j, k, l)
  else {
    fields.fail(typeid(T));
  }
#undef TANDEM_MEMBERS
}

}  // namespace detail

/// Passes x: numbers, enumerations, fixed-size Eigen types, groups, std::array, std::tuple, std::optional, and structs
/// of these. Structs are aggregates of up to 12 members or have a member `auto fields() { return std::tie(…); }`. Other
/// types, such as pointers, compile but fail when passed.
template <class T>
void pass_fields(T& x, Fields& fields) {
  if constexpr (std::is_const_v<T>) {
    fields.fail(typeid(T));
  } else if constexpr (std::same_as<T, double>) {
    fields.pass(&x, 1);
  } else if constexpr (std::same_as<T, float>) {
    double number = x;
    fields.pass(&number, 1);
    x = static_cast<float>(number);
  } else if constexpr (std::is_enum_v<T>) {
    auto number = static_cast<std::underlying_type_t<T>>(x);
    pass_fields(number, fields);
    x = static_cast<T>(number);
  } else if constexpr (std::is_integral_v<T>) {
    constexpr double kExact = 9007199254740992.0;  // 2^53
    double number = static_cast<double>(x);
    fields.pass_integer(number, std::max(-kExact, static_cast<double>(std::numeric_limits<T>::lowest())),
                        std::min(kExact, static_cast<double>(std::numeric_limits<T>::max())));
    x = static_cast<T>(number);
  } else if constexpr (std::is_bounded_array_v<T>) {
    for (auto& entry : x) pass_fields(entry, fields);
  } else if constexpr (requires { x.fields(); }) {
    std::apply([&](auto&... member) { detail::pass_each(fields, member...); }, x.fields());
  } else if constexpr (requires { pass_group(x, fields); }) {
    pass_group(x, fields);
  } else if constexpr (std::is_base_of_v<Eigen::PlainObjectBase<T>, T>) {
    if constexpr (T::SizeAtCompileTime == Eigen::Dynamic) {
      fields.fail(typeid(T));
    } else if constexpr (std::same_as<typename T::Scalar, double>) {
      fields.pass(x.data(), std::size_t(T::SizeAtCompileTime));
    } else {
      for (int i = 0; i < int(T::SizeAtCompileTime); ++i) pass_fields(x.data()[i], fields);
    }
  } else if constexpr (requires { x.coeffs().data(); }) {  // quaternions
    pass_fields(x.coeffs(), fields);
  } else if constexpr (detail::is_optional<T>) {
    bool there = x.has_value();
    pass_fields(there, fields);
    if constexpr (std::default_initializable<typename T::value_type>) {
      if (there && !x) x.emplace();
      if (!there) x.reset();
      if (there) pass_fields(*x, fields);
    } else {
      fields.fail(typeid(T));
    }
  } else if constexpr (requires { std::tuple_size<T>::value; }) {  // std::array, tuple, pair
    std::apply([&](auto&... member) { detail::pass_each(fields, member...); }, x);
  } else {
    detail::pass_members(x, fields);
  }
}

}  // namespace tandem
