#include <cstdio>
#include <ctime>

#include <unistd.h>

#include <tandem/studies/support/resources.hpp>

namespace tandem {
namespace {

double seconds_of(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return double(now.tv_sec) + 1e-9 * double(now.tv_nsec);
}

}  // namespace

double processor_seconds() { return seconds_of(CLOCK_PROCESS_CPUTIME_ID); }
double thread_seconds() { return seconds_of(CLOCK_THREAD_CPUTIME_ID); }

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
