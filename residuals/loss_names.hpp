#pragma once

#include <string_view>
#include <utility>

#include <tandem/residuals/loss.hpp>

namespace tandem {

/// Names of the losses in options, scenarios and files.
inline constexpr std::pair<Loss::Kind, std::string_view> kLossNames[] = {
    {Loss::Kind::none, "off"},      {Loss::Kind::huber, "huber"},
    {Loss::Kind::cauchy, "cauchy"}, {Loss::Kind::geman_mcclure, "geman-mcclure"},
    {Loss::Kind::tukey, "tukey"},   {Loss::Kind::student_t, "student-t"},
};

}  // namespace tandem
