#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <exception>
#include <map>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>

#include <fmt/format.h>
#ifdef TANDEM_HAS_MPI
#include <mpi.h>
#endif

#include <tandem/lie/error.hpp>
#include <tandem/studies/study/study_ranks.hpp>
#include <tandem/studies/study/trial.hpp>
#include <tandem/studies/study/trial_message.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

/// Returns the number of processes that the MPI launcher started, from its environment variables; 1 without a launcher.
int launched_ranks() {
  for (const char* variable : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE"})
    if (const char* text = std::getenv(variable)) return parse_positive_integer(text).value_or(1);
  return 1;
}

}  // namespace

#ifndef TANDEM_HAS_MPI

struct StudyRanks::Impl {};

std::unique_ptr<StudyRanks> StudyRanks::launched() {
  if (launched_ranks() > 1)
    throw Error("this build has no MPI: configure with -DTANDEM_WITH_MPI=ON, or run shards with --shard I/N");
  return nullptr;
}
StudyRanks::~StudyRanks() = default;
bool StudyRanks::is_leader() const { return true; }
int StudyRanks::lost_workers() const { return 0; }
StudyProgress StudyRanks::run_leader(StudyDatabase&, const StudyRunOptions&) { return {}; }
void StudyRanks::run_worker(const Study&) {}
void StudyRanks::abandon(int status) { std::exit(status); }

#else

namespace {

using RankClock = std::chrono::steady_clock;

enum Tag : int { kResult = 1, kAssignment = 2, kHeartbeat = 3 };
constexpr auto kHeartbeatInterval = std::chrono::seconds(2), kWorkerTimeout = std::chrono::seconds(30);
constexpr auto kPoll = std::chrono::milliseconds(1);
constexpr std::uint64_t kNoMore = ~std::uint64_t(0);

/// Runs one trial at a time in a separate thread. The main thread stays free for MPI communication.
class TrialThread {
 public:
  explicit TrialThread(const Study& study) : study_(study), thread_([this](std::stop_token stop) { run(stop); }) {}
  ~TrialThread() {
    stop_ = true;
    thread_.request_stop();
    changed_.notify_all();
  }
  TrialThread(const TrialThread&) = delete;
  TrialThread& operator=(const TrialThread&) = delete;

  void start(std::size_t trial) {
    const std::lock_guard lock(mutex_);
    trial_ = trial;
    changed_.notify_all();
  }
  std::optional<TrialResult> take() {
    const std::lock_guard lock(mutex_);
    if (failure_) std::rethrow_exception(failure_);
    return std::exchange(result_, std::nullopt);
  }

 private:
  void run(const std::stop_token& stop) {
    while (true) {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return trial_ || stop.stop_requested(); });
      if (stop.stop_requested()) return;
      const std::size_t trial = *std::exchange(trial_, std::nullopt);
      lock.unlock();
      std::optional<TrialResult> result;
      std::exception_ptr failure;
      try {
        result = run_trial(study_, trial, &stop_);
      } catch (...) {  // memory is short
        failure = std::current_exception();
      }
      lock.lock();
      result_ = std::move(result);
      failure_ = failure;
    }
  }

  const Study& study_;
  std::atomic<bool> stop_{false};
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<std::size_t> trial_;
  std::optional<TrialResult> result_;
  std::exception_ptr failure_;
  std::jthread thread_;  // last: joined before the other members are destroyed
};

void assign(int rank, std::uint64_t trial) { MPI_Send(&trial, 1, MPI_UINT64_T, rank, kAssignment, MPI_COMM_WORLD); }

/// Returns a pending message from `source`, or nullopt.
std::optional<std::pair<MPI_Status, std::string>> pending_message(int source) {
  int there = 0;
  MPI_Status status;
  MPI_Iprobe(source, MPI_ANY_TAG, MPI_COMM_WORLD, &there, &status);
  if (!there) return {};
  int size = 0;
  MPI_Get_count(&status, MPI_BYTE, &size);
  std::string bytes(std::size_t(size), '\0');
  MPI_Recv(bytes.data(), size, MPI_BYTE, status.MPI_SOURCE, status.MPI_TAG, MPI_COMM_WORLD, &status);
  return std::pair(status, std::move(bytes));
}

/// State of a worker as known to rank 0.
struct Worker {
  RankClock::time_point heard;
  std::optional<std::size_t> trial{};
  bool idle = false, lost = false;  ///< idle: ready, without a trial
};

/// Returns whether all ranks have the hash of rank 0.
bool equal_on_all_ranks(std::uint64_t hash) {
  std::uint64_t of_lead = hash;
  MPI_Bcast(&of_lead, 1, MPI_UINT64_T, 0, MPI_COMM_WORLD);
  int same = of_lead == hash, all = 0;
  MPI_Allreduce(&same, &all, 1, MPI_INT, MPI_MIN, MPI_COMM_WORLD);
  return all;
}

}  // namespace

struct StudyRanks::Impl {
  int rank = 0, size = 1;
  int lost = 0;
  bool finalises = true;  ///< false with an Ipopt that initialises MPI when it is loaded, such as that of Debian 13
};

std::unique_ptr<StudyRanks> StudyRanks::launched() {
  if (launched_ranks() < 2) return nullptr;
  int initialised = 0, provided = 0;
  MPI_Initialized(&initialised);
  if (!initialised) MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided);
  auto impl = std::make_unique<Impl>();
  impl->finalises = !initialised;
  MPI_Comm_rank(MPI_COMM_WORLD, &impl->rank);
  MPI_Comm_size(MPI_COMM_WORLD, &impl->size);
  return std::unique_ptr<StudyRanks>(new StudyRanks(std::move(impl)));
}

StudyRanks::StudyRanks(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

StudyRanks::~StudyRanks() {
  if (impl_->lost > 0) abandon(0);  // MPI_Finalize would wait for lost ranks for ever
  if (impl_->finalises) MPI_Finalize();
}

bool StudyRanks::is_leader() const { return impl_->rank == 0; }
int StudyRanks::lost_workers() const { return impl_->lost; }

void StudyRanks::abandon(int status) {
  std::fflush(nullptr);
  MPI_Abort(MPI_COMM_WORLD, status);
  std::_Exit(status);
}

void StudyRanks::run_worker(const Study& study) {
  if (!equal_on_all_ranks(study.hash())) return;
  TrialThread thread(study);
  const std::string ready;
  MPI_Send(ready.data(), 0, MPI_BYTE, 0, kResult, MPI_COMM_WORLD);
  RankClock::time_point beat = RankClock::now();
  while (true) {
    if (const auto message = pending_message(0)) {
      std::uint64_t trial = kNoMore;
      std::memcpy(&trial, message->second.data(), std::min(sizeof trial, message->second.size()));
      if (trial == kNoMore) return;
      thread.start(trial);
    }
    if (const auto result = thread.take()) {
      const std::string bytes = serialized(*result);
      MPI_Send(bytes.data(), static_cast<int>(bytes.size()), MPI_BYTE, 0, kResult, MPI_COMM_WORLD);
    } else if (RankClock::now() - beat > kHeartbeatInterval) {
      MPI_Send(ready.data(), 0, MPI_BYTE, 0, kHeartbeat, MPI_COMM_WORLD);
      beat = RankClock::now();
    }
    std::this_thread::sleep_for(kPoll);
  }
}

StudyProgress StudyRanks::run_leader(StudyDatabase& database, const StudyRunOptions& options) {
  const Study& study = database.study();
  if (!equal_on_all_ranks(study.hash())) throw Error("the ranks read different study files: all need the same file");
  const std::vector<bool> finished = database.finished();
  std::deque<std::size_t> to_do;
  for (std::size_t i = 0; i < finished.size(); ++i)
    if (!finished[i]) to_do.push_back(i);

  StudyProgress progress;
  progress.all = finished.size();
  const std::size_t before = progress.done = progress.all - to_do.size();
  const auto begun = RankClock::now();
  std::map<int, Worker> workers;
  for (int rank = 1; rank < impl_->size; ++rank) workers[rank].heard = begun;
  TrialThread own(study);
  bool own_is_idle = true;

  const auto next = [&]() -> std::optional<std::size_t> {
    if (to_do.empty()) return {};
    const std::size_t trial = to_do.front();
    to_do.pop_front();
    return trial;
  };
  const auto store = [&](const TrialResult& result) {
    database.add(result);
    ++progress.done;
    progress.failed += !result.converged();
    progress.rate = double(progress.done - before) / std::chrono::duration<double>(RankClock::now() - begun).count();
    progress.seconds_left = double(progress.all - progress.done) / progress.rate;
    if (options.progress) options.progress(progress);
  };
  const auto assign_next = [&](int rank, Worker& worker) {
    worker.trial = next();
    worker.idle = !worker.trial;
    if (worker.trial) assign(rank, *worker.trial);
  };
  while (progress.done < progress.all && !(options.stop && *options.stop)) {
    while (const auto message = pending_message(MPI_ANY_SOURCE)) {
      Worker& worker = workers.at(message->first.MPI_SOURCE);
      if (worker.lost) continue;  // its trial was reassigned
      worker.heard = RankClock::now();
      if (message->first.MPI_TAG != kResult) continue;
      if (!message->second.empty()) store(deserialized(message->second));
      assign_next(message->first.MPI_SOURCE, worker);
    }
    if (const auto result = own.take()) {
      store(*result);
      own_is_idle = true;
    }
    if (own_is_idle)
      if (const auto trial = next()) {
        own.start(*trial);
        own_is_idle = false;
      }
    for (auto& [rank, worker] : workers)
      if (!worker.lost && RankClock::now() - worker.heard > kWorkerTimeout) {
        worker.lost = true;
        ++impl_->lost;
        worker.idle = false;
        if (worker.trial) to_do.push_front(*worker.trial);
      } else if (worker.idle && !to_do.empty()) {
        assign_next(rank, worker);  // a trial of a lost worker
      }
    std::this_thread::sleep_for(kPoll);
  }
  for (const auto& [rank, worker] : workers)
    if (!worker.lost) assign(rank, kNoMore);
  return progress;
}

#endif

}  // namespace tandem
