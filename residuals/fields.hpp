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
/// function, pass_fields, visits the members of a type in both directions. Residuals need it for files only: a residual
/// without fields() can be used in a problem, but not written.
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

template <class... Ts>
void pass_each(Fields& fields, Ts&... x) {
  (pass_fields(x, fields), ...);
}

}  // namespace detail

/// Passes x: a number, an enumeration, a fixed-size Eigen type, a group, or a std::array, std::tuple or std::optional
/// of these. Also passes a type with a member `auto fields() { return std::tie(…); }` that returns all its members in a
/// fixed order. Other types compile but fail when passed.
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
    fields.fail(typeid(T));
  }
}

}  // namespace tandem
