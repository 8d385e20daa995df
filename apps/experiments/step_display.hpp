#pragma once

#include <cstddef>
#include <ostream>
#include <string>

namespace km {

/// Shows which step runs, what it says, and how long all will still take, unless the step already
/// takes longer than expected: one line redrawn on a terminal, elsewhere a line every
/// kPlainInterval_s. Times are of any clock [s].
class StepDisplay {
 public:
  static constexpr double kPlainInterval_s = 10.0;

  StepDisplay(std::ostream& output, bool terminal, int width)
      : output_(output), terminal_(terminal), width_(width) {}

  /// On standard output.
  static StepDisplay standard_output();

  /// A step begins: number `index` (from 1) of `count`; `later_s` is what those after it will take.
  void start(std::size_t index, std::size_t count, const std::string& title, double expected_s,
             double later_s, double now_s);

  /// `line` is the last that the step printed; it may be empty.
  void update(const std::string& line, double now_s);

  /// The step's own line for good: "[3/17] team, City: done in 2 min 4 s".
  void finish(const std::string& result, double now_s);

  /// What update() draws.
  [[nodiscard]] std::string text(const std::string& line, double now_s) const;

 private:
  std::ostream& output_;
  bool terminal_;
  int width_;
  std::string heading_;
  double expected_s_ = 0.0, later_s_ = 0.0, start_s_ = 0.0, drawn_s_ = 0.0;
};

/// "about 12 min", "less than a minute".
[[nodiscard]] std::string rough_duration(double seconds);

}  // namespace km
