// SPDX-License-Identifier: Zlib
// Queries many pairs with many threads. Each pair is a separate query, so the answers do not depend on the threads.
#include <algorithm>
#include <atomic>
#include <exception>
#include <thread>

#include "runtime/grow.h"
#include "runtime/vps_contacts.h"

namespace vps {
namespace {

class BatchWork {
 public:
  BatchWork(std::span<const PairQuery> queries, std::span<PairAnswer> answers, std::span<Scratch> workers) noexcept
      : queries_(queries), answers_(answers), workers_(workers) {}

  static void work(void* batch, std::uint32_t worker) { static_cast<BatchWork*>(batch)->work(worker); }

 private:
  void work(std::uint32_t worker) noexcept {
    // Blocks of pairs, because a pair that is apart costs less than an access to the shared counter.
    constexpr std::size_t kBlock = 16;
    for (std::size_t at = next_.fetch_add(kBlock); at < queries_.size(); at = next_.fetch_add(kBlock)) {
      for (std::size_t i = at; i < std::min(at + kBlock, queries_.size()); ++i) answer(i, workers_[worker]);
    }
  }
  void answer(std::size_t i, Scratch& scratch) noexcept {
    const PairQuery& query = queries_[i];
    PairAnswer& answer = answers_[i];
    answer = {};
    if (query.shell == nullptr || query.map == nullptr) {
      answer.status = Status::missing_part;
      return;
    }
    const Pose pose = relative_pose(query.map_pose, query.shell_pose);
    answer.status = traverse(*query.shell, *query.map, pose, query.options, scratch, query.out, answer.result);
  }

  const std::span<const PairQuery> queries_;
  const std::span<PairAnswer> answers_;
  const std::span<Scratch> workers_;
  std::atomic<std::size_t> next_{0};
};

void run_on_threads(void*, std::uint32_t workers, Executor::Task task, void* batch) {
  // Workers share all pairs that are left. If threads cannot be started, fewer workers do all the work.
  std::vector<std::thread> threads;
  std::uint32_t started = 1;
  try {
    threads.reserve(workers);
    for (; started < workers; ++started) threads.emplace_back(task, batch, started);
  } catch (const std::exception&) {
  }
  task(batch, 0);
  for (std::thread& thread : threads) thread.join();
}

}  // namespace

Executor thread_executor(std::uint32_t workers) noexcept {
  Executor executor;
  executor.workers = workers > 0 ? workers : std::max(1U, std::thread::hardware_concurrency());
  executor.run = run_on_threads;
  return executor;
}

Status traverse_batch(std::span<const PairQuery> queries, std::span<PairAnswer> answers, BatchScratch& scratch,
                      const Executor& executor) noexcept {
  if (queries.size() != answers.size() || executor.workers == 0) return Status::bad_argument;
  // More workers than pairs would have nothing to do.
  const auto workers =
      static_cast<std::uint32_t>(std::min<std::size_t>(executor.workers, std::max<std::size_t>(queries.size(), 1)));
  const auto grow = [&] {
    if (scratch.workers.size() < workers) scratch.workers.resize(workers);
  };
  if (const Status status = detail::try_to_grow(grow); status != Status::ok) return status;
  BatchWork batch(queries, answers, scratch.workers);
  if (executor.run == nullptr || workers == 1) {
    BatchWork::work(&batch, 0);
  } else {
    executor.run(executor.context, workers, BatchWork::work, &batch);
  }
  return Status::ok;
}

}  // namespace vps
