#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

namespace km {

/// How long steps will take: as thought before, times how much longer (or shorter) than thought the
/// steps of the same program have taken in this run, on this machine, under its load.
class StepTimes {
 public:
  /// The next step; `thought_s` is 0 if it will not be run.
  void add(std::string program, double thought_s);

  /// Step `index`, from 0, is done.
  void note(std::size_t index, double took_s);

  [[nodiscard]] double expected_s(std::size_t index) const;

  /// Of all steps after `index`.
  [[nodiscard]] double later_s(std::size_t index) const;

 private:
  struct Thought {
    std::string program;
    double seconds = 0.0;
  };
  struct Pace {
    double took_s = 0.0, thought_s = 0.0;
  };

  std::vector<Thought> steps_;
  std::map<std::string, Pace> paces_;  // of programs, over their steps so far
};

}  // namespace km
