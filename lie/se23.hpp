#pragma once

/// SE23, extended poses: rotation, position and velocity. They are the case K = 2 of SE_K(3), and written there.
#include <tandem/lie/sek3.hpp>
