#pragma once

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include "modules/recorded_graph/g2o_io.hpp"
#include "test/support/patience.hpp"
#include "test/support/test.hpp"

namespace km {

/// A full pipe without a reader.
class FullPipe {
 public:
  FullPipe() {
    REQUIRE(pipe2(ends_.data(), O_CLOEXEC | O_NONBLOCK) == 0);
    const std::array<char, 4096> bytes{};
    while (write(ends_[1], bytes.data(), bytes.size()) > 0) {
    }
    fcntl(ends_[1], F_SETFL, 0);  // further writes block
  }
  ~FullPipe() {
    close(ends_[0]);
    close(ends_[1]);
  }
  FullPipe(const FullPipe&) = delete;
  FullPipe& operator=(const FullPipe&) = delete;

  [[nodiscard]] int writer() const { return ends_[1]; }

 private:
  std::array<int, 2> ends_{};
};

/// A walk of one robot that takes longer than any test, in `folder`.
inline fs::path long_walk(const fs::path& folder, RobotId robot) {
  G2oGraph graph;
  RelativePose step;
  step.T_from_to.translation() = Eigen::Vector3d(1.0, 0.0, 0.0);
  step.covariance = 1e-4 * Matrix6::Identity();
  for (std::uint32_t i = 0; i < 5000; ++i) {
    step.from = {robot, i};
    step.to = {robot, i + 1};
    graph.edges.push_back(step);
  }
  fs::path file = folder / ("walk" + std::to_string(robot) + ".g2o");
  write_g2o(file, graph);
  return file;
}

/// Waits until `file` has `lines` lines.
inline bool wait_for_lines(const fs::path& file, int lines) {
  const auto end = std::chrono::steady_clock::now() + kPatience;
  while (std::chrono::steady_clock::now() < end) {
    std::ifstream in(file);
    int count = 0;
    for (std::string line; std::getline(in, line);) ++count;
    if (count >= lines) return true;
    poll(nullptr, 0, 50);
  }
  return false;
}

}  // namespace km
