#pragma once

/// Rigid motions SE3. Implemented as the case K = 1 of SE_K(3).
#include <tandem/lie/sek3.hpp>
