#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "modules/core/data/byte_archive.hpp"
#include "modules/core/ids.hpp"

namespace km {

/// A robot that this robot receives directly, and the time since its last message [s].
struct RobotLink {
  RobotId robot = 0;
  float silent_s = 0.0F;
};

/// A named number: bytes of a kind of traffic, or the load of a module.
struct NamedNumber {
  std::string name;
  double value = 0.0;
};

/// State of a robot, sampled once a second; the newest counts.
struct RobotSample {
  std::string name = {};
  std::string phase = {};       ///< "running", "finished", "settled", "leaving"
  double dataset_time_s = 0.0;  ///< Time since the start of its input.
  std::uint32_t keyframes = 0;
  std::uint32_t skipped_frames = 0;
  RobotId anchor = 0;       ///< Robot whose odometry frame its optimised poses are in.
  bool tentative = false;   ///< True if only closures at one place tie it to the anchor.
  std::uint32_t round = 0;  ///< Round of the optimisation.
  double cost = 0.0;        ///< Cost of the team's graph, see OptimizerProgress.
  double gradient_norm = 0.0;
  double cpu_s = 0.0;  ///< Processor time of all threads since the start.
  double resident_MB = 0.0;
  std::vector<RobotLink> links = {};
  std::vector<NamedNumber> sent_bytes = {};  ///< Bytes by kind since the start.
  std::vector<NamedNumber> loads = {};       ///< Load of each module: share of the time in which
                                             ///< it works.
};

void describe(auto& archive, As<RobotSample> auto& sample) {
  constexpr std::size_t kMost = 10000, kLinkBytes = 1 + 4, kNumberBytes = 1 + 8;
  archive.printable(sample.name);
  archive.printable(sample.phase);
  archive(sample.dataset_time_s, sample.keyframes, sample.skipped_frames, sample.anchor,
          sample.tentative, sample.round, sample.cost, sample.gradient_norm, sample.cpu_s,
          sample.resident_MB);
  archive.list(sample.links, kMost, kLinkBytes,
               [&](auto& link) { archive(link.robot, link.silent_s); });
  for (auto* numbers : {&sample.sent_bytes, &sample.loads})
    archive.list(*numbers, kMost, kNumberBytes, [&](auto& number) {
      archive.printable(number.name);
      archive(number.value);
    });
}

}  // namespace km
