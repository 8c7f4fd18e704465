#pragma once

#include <functional>
#include <string>

#include <tandem/problem/navigation/trajectory.hpp>
#include <tandem/studies/support/csv.hpp>

namespace tandem {

using NumberRow = Stamped<Eigen::VectorXd>;

/// The columns of a file of numbers by time, "t,x,y,z": times to so many decimals, the others as `cell` writes a value of
/// the named column.
CsvTable<NumberRow> number_columns(const std::string& names, int time_decimals,
                                   const std::function<CsvCell(const std::string& name, double value)>& cell);

}  // namespace tandem
