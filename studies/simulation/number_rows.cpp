#include <tandem/studies/simulation/number_rows.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {

CsvTable<NumberRow> number_columns(const std::string& names, int time_decimals,
                                   const std::function<CsvCell(const std::string&, double)>& cell) {
  CsvTable<NumberRow> table;
  Eigen::Index i = -1;
  for (const std::string_view part : split(names, ',')) {
    const std::string name(part);
    if (i < 0)
      table.add(name, "time [s]", [time_decimals](const NumberRow& r) { return CsvCell::fixed(r.t, time_decimals); });
    else
      table.add(name, "value", [=](const NumberRow& r) { return cell(name, r.value[i]); });
    ++i;
  }
  return table;
}

}  // namespace tandem
