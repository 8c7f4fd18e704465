#pragma once

/// Extended poses SE23: rotation, position and velocity. Implemented as the case K = 2 of SE_K(3).
#include <tandem/lie/sek3.hpp>
