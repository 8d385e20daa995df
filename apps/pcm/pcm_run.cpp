#include "apps/pcm/pcm_run.hpp"

#include <algorithm>
#include <ctime>
#include <stdexcept>
#include <utility>

#include "modules/outlier_rejection/cycle_test.hpp"
#include "modules/outlier_rejection/max_clique.hpp"
#include "modules/outlier_rejection/pcm.hpp"

namespace km {
namespace {

double cpu_now_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// The clique search of one run and what it is asked to note.
class Additions {
 public:
  explicit Additions(const PcmConfig& config)
      : clique_(static_cast<std::uint64_t>(config.max_search_nodes), config.search) {
    run_.search = config.search;
  }

  void add(const std::vector<std::size_t>& neighbours, double check_s) {
    const double begin_s = cpu_now_s();
    clique_.add(neighbours);
    const double search_s = cpu_now_s() - begin_s;
    run_.edges += neighbours.size();
    run_.additions.push_back({.vertices = clique_.size(),
                              .check_s = check_s,
                              .search_s = search_s,
                              .clique = clique_.clique().size(),
                              .true_members = std::nullopt,
                              .true_vertices = std::nullopt,
                              .bound = clique_.bound()});
  }

  PcmAddition& last() { return run_.additions.back(); }
  PcmRun& run() { return run_; }
  const MaxClique& clique() const { return clique_; }

  PcmRun finish() {
    run_.search_nodes = clique_.search_nodes();
    run_.searches_ended = clique_.searches_ended();
    return std::move(run_);
  }

 private:
  MaxClique clique_;
  PcmRun run_;
};

}  // namespace

PcmRun run_pcm(const std::vector<LabelledClosure>& closures, const PcmConfig& config,
               const PcmProgress& progress) {
  const CycleTest test(config);
  Additions additions(config);
  std::vector<PreparedClosure> vertices;
  std::vector<bool> is_true;
  std::size_t true_vertices = 0;
  for (std::size_t n = 0; n < closures.size(); ++n) {
    if (progress) progress(n);
    const auto& [closure, outlier] = closures[n];
    if (!is_usable(closure))
      throw std::invalid_argument("closure " + to_string(closure.from.id) + " -> " +
                                  to_string(closure.to.id) + " cannot be weighed");
    const double begin_s = cpu_now_s();
    const OrientedClosure oriented = test.orient(closure);
    if (config.odometry_gate && !test.agrees_with_odometry(oriented)) {
      ++(outlier ? additions.run().dropped_false : additions.run().dropped_true);
      continue;
    }
    PreparedClosure added(oriented);
    const std::vector<std::size_t> consistent = test.consistent_with(added, vertices);
    vertices.push_back(std::move(added));
    is_true.push_back(!outlier);
    additions.add(consistent, cpu_now_s() - begin_s);
    const auto members = additions.clique().clique();
    additions.last().true_members = static_cast<std::size_t>(
        std::count_if(members.begin(), members.end(), [&](std::size_t v) { return is_true[v]; }));
    true_vertices += outlier ? 0 : 1;
    additions.last().true_vertices = true_vertices;
  }
  return additions.finish();
}

PcmRun run_pcm(const ConsistencyRows& rows, const PcmConfig& config, const PcmProgress& progress) {
  Additions additions(checked(config));
  for (std::size_t n = 0; n < rows.size(); ++n) {
    if (progress) progress(n);
    additions.add(rows[n], 0.0);
  }
  return additions.finish();
}

std::string to_string(CliqueMethod method) {
  switch (method) {
    case CliqueMethod::kExact:
      return "exact";
    case CliqueMethod::kIncremental:
      return "incremental";
    case CliqueMethod::kBatch:
      return "batch";
  }
  return {};
}

}  // namespace km
