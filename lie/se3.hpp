#pragma once

/// SE3, rigid motions of space. They are the case K = 1 of SE_K(3), and written there.
#include <tandem/lie/sek3.hpp>
