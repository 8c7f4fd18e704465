#pragma once

/// Colours of figures. The first four are told apart with any kind of colour vision (Okabe & Ito 2008).
namespace tandem::palette {

inline constexpr const char* blue = "#0072B2";
inline constexpr const char* vermilion = "#D55E00";
inline constexpr const char* orange = "#E69F00";
inline constexpr const char* sky_blue = "#56B4E9";
inline constexpr const char* grey = "#999999";
inline constexpr const char* pale = "#c4c4c4";

}  // namespace tandem::palette
