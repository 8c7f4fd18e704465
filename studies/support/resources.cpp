#include <cstdio>
#include <ctime>

#include <unistd.h>

#include <tandem/studies/support/resources.hpp>

namespace tandem {

double processor_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return double(now.tv_sec) + 1e-9 * double(now.tv_nsec);
}

std::optional<double> resident_megabytes() {
  std::FILE* const file = std::fopen("/proc/self/statm", "r");
  if (!file) return {};
  long size = 0, resident = 0;
  const bool read = std::fscanf(file, "%ld %ld", &size, &resident) == 2;
  std::fclose(file);
  if (!read) return {};
  return 1e-6 * double(resident) * double(sysconf(_SC_PAGESIZE));
}

}  // namespace tandem
