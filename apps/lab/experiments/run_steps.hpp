#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <ostream>
#include <string>
#include <vector>

#include "apps/lab/experiments/step_record.hpp"
#include "runtime/signal_watch.hpp"

namespace km {

/// Shows the running step, its last line, and the remaining time, unless the step already takes
/// longer than expected. It redraws one line on a terminal; otherwise it prints a line every
/// kPlainInterval_s. The expected time of a step is its estimate, times the ratio of actual to
/// estimated times of the same program in this run. Times are of any clock [s].
class StepDisplay {
 public:
  static constexpr double kPlainInterval_s = 10.0;

  struct ExpectedStep {
    std::string title, program;
    double seconds = 0.0;  ///< 0 if the step is not run.
  };

  StepDisplay(std::ostream& output, bool terminal, int width)
      : output_(output), terminal_(terminal), width_(width) {}

  /// Prints to standard output.
  static StepDisplay standard_output();

  /// Sets the steps in order.
  void expect(std::vector<ExpectedStep> steps) { steps_ = std::move(steps); }

  /// Step `index`, from 0, begins.
  void start(std::size_t index, double now_s);

  /// `line` is the last that the step printed; it may be empty.
  void update(const std::string& line, double now_s);

  /// Prints the final line of the step: "[3/17] team, City: done in 2 min 4 s".
  void finish(const std::string& result, double now_s);

  /// Text that update() draws.
  [[nodiscard]] std::string text(const std::string& line, double now_s) const;

 private:
  struct Pace {
    double took_s = 0.0, estimate_s = 0.0;
  };

  [[nodiscard]] double expected_s(std::size_t index) const;
  [[nodiscard]] std::string heading() const;

  std::ostream& output_;
  bool terminal_;
  int width_;
  std::vector<ExpectedStep> steps_;
  std::map<std::string, Pace> paces_;  // pace of each program over its steps so far
  std::size_t index_ = 0;              // index of the running step
  double start_s_ = 0.0, drawn_s_ = 0.0;
};

/// Outcome of the steps.
struct StepsOutcome {
  std::size_t made = 0;  ///< Run now.
  std::size_t kept = 0;  ///< Done before, or found.
  std::vector<std::string>
      problems;          ///< Reasons why steps are not done, with the last lines of programs.
  bool stopped = false;  ///< True after a signal; finished steps are kept.
};

/// Runs the steps that are not done, in order; each writes its record below `results` when it is
/// done. With `again` also runs those that are done. A step that fails loses its record unless it
/// failed before it wrote any file beside its outputs. Steps that need it are not run; the others
/// are. A signal is passed to the running program, a second one ends it at once; no further step
/// begins. Throws std::runtime_error if `results` cannot be written to.
[[nodiscard]] StepsOutcome run_steps(const std::vector<Step>& steps,
                                     const std::filesystem::path& results, bool again,
                                     SignalWatch& signals, StepDisplay& display);

}  // namespace km
