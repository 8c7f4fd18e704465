#pragma once

#include <functional>
#include <string>

#include <tandem/problem/navigation/trajectory.hpp>
#include <tandem/studies/support/csv.hpp>

namespace tandem {

using NumberRow = Stamped<Eigen::VectorXd>;

/// Returns the columns of a CSV file of numbers over time. `names`: column names, time first, as in "t,x,y,z".
/// `time_decimals`: decimals of the time. `cell` formats a value of the named column.
CsvTable<NumberRow> number_columns(const std::string& names, int time_decimals,
                                   const std::function<CsvCell(const std::string& name, double value)>& cell);

}  // namespace tandem
