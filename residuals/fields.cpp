#include <cmath>
#include <cstdlib>
#include <memory>

#include <cxxabi.h>

#include <tandem/residuals/fields.hpp>

namespace tandem {

void Fields::pass(double* x, std::size_t n) {
  if (!reads_) {
    values_.insert(values_.end(), x, x + n);
  } else {
    for (std::size_t i = 0; i < n && count_ + i < given_.size(); ++i) x[i] = given_[count_ + i];
  }
  count_ += n;
}

void Fields::pass_integer(double& x, double lowest, double highest) {
  const double before = x;
  pass(&x, 1);
  if (x >= lowest && x <= highest && x == std::floor(x)) return;
  fail("a member must be an integer from " + std::to_string(static_cast<long long>(lowest)) + " to " +
       std::to_string(static_cast<long long>(highest)) + ", but is " + std::to_string(x));
  x = before;  // the caller converts x to its integer type
}

void Fields::fail(std::string why) {
  if (error_.empty()) error_ = std::move(why);
}

void Fields::fail(const std::type_info& type) {
  fail("it contains a " + type_name(type) + ", which has no member function fields()");
}

namespace {

constexpr double kUnit = 1e-6;  // far above rounding errors, far below a visible error

void check_unit(double squared_norm, Fields& fields) {
  if (!(std::abs(squared_norm - 1) < kUnit)) fields.fail("the numbers of a rotation are not of unit length");
}

void replace_all(std::string& text, const std::string& what, const std::string& by) {
  for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += by.size())
    text.replace(at, what.size(), by);
}

}  // namespace

void pass_group(SO2& X, Fields& fields) {
  double x[2] = {X.cos_angle(), X.sin_angle()};
  fields.pass(x, 2);
  check_unit(x[0] * x[0] + x[1] * x[1], fields);
  X = SO2::from_unit(x[0], x[1]);
}

void pass_group(SE2& X, Fields& fields) {
  SO2 R = X.rotation();
  Vector<2> t = X.translation();
  pass_group(R, fields);
  fields.pass(t.data(), 2);
  X = {R, t};
}

void pass_group(SO3& X, Fields& fields) {
  SO3::Quaternion q = X.quaternion();
  fields.pass(q.coeffs().data(), 4);
  check_unit(q.squaredNorm(), fields);
  X = SO3::from_unit(q);
}

std::string type_name(const std::type_info& type) {
  int status = 0;
  const std::unique_ptr<char, void (*)(void*)> demangled(abi::__cxa_demangle(type.name(), nullptr, nullptr, &status),
                                                         std::free);
  std::string name = status == 0 ? demangled.get() : type.name();
  replace_all(name, " >", ">");
  replace_all(name, "tandem::BasicSEK3<1, double>", "tandem::SE3");
  replace_all(name, "tandem::BasicSEK3<2, double>", "tandem::SE23");
  for (const char* group : {"SO2", "SO3", "SE2"})
    replace_all(name, std::string("tandem::Basic") + group + "<double>", std::string("tandem::") + group);
  const std::string vector = "tandem::BasicRn<";  // …N, double>
  for (std::size_t at = 0; (at = name.find(vector, at)) != std::string::npos;) {
    const std::size_t end = name.find_first_not_of("0123456789", at + vector.size());
    if (name.compare(end, 9, ", double>") == 0) name.erase(end, 8);
    name.replace(at, vector.size(), "tandem::Rn<");
  }
  return name;
}

}  // namespace tandem
