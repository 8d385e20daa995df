#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <ostream>
#include <string>
#include <vector>

#include "apps/experiments/step_record.hpp"
#include "runtime/supervisor.hpp"

namespace km {

/// Shows which step runs, what it says, and how long all will still take, unless the step already
/// takes longer than expected: one line redrawn on a terminal, elsewhere a line every
/// kPlainInterval_s. A step is expected to take as long as thought before, times how much longer
/// (or shorter) than thought those of the same program have taken in this run. Times are of any
/// clock [s].
class StepDisplay {
 public:
  static constexpr double kPlainInterval_s = 10.0;

  struct Thought {
    std::string title, program;
    double seconds = 0.0;  ///< 0 if it will not be run.
  };

  StepDisplay(std::ostream& output, bool terminal, int width)
      : output_(output), terminal_(terminal), width_(width) {}

  /// On standard output.
  static StepDisplay standard_output();

  /// What will be done, in order.
  void expect(std::vector<Thought> steps) { steps_ = std::move(steps); }

  /// Step `index`, from 0, begins.
  void start(std::size_t index, double now_s);

  /// `line` is the last that the step printed; it may be empty.
  void update(const std::string& line, double now_s);

  /// The step's own line for good: "[3/17] team, City: done in 2 min 4 s".
  void finish(const std::string& result, double now_s);

  /// What update() draws.
  [[nodiscard]] std::string text(const std::string& line, double now_s) const;

 private:
  struct Pace {
    double took_s = 0.0, thought_s = 0.0;
  };

  [[nodiscard]] double expected_s(std::size_t index) const;
  [[nodiscard]] std::string heading() const;

  std::ostream& output_;
  bool terminal_;
  int width_;
  std::vector<Thought> steps_;
  std::map<std::string, Pace> paces_;  // of programs, over their steps so far
  std::size_t index_ = 0;              // of the step that runs
  double start_s_ = 0.0, drawn_s_ = 0.0;
};

/// What came of the steps.
struct StepsOutcome {
  std::size_t made = 0;               ///< Run now.
  std::size_t kept = 0;               ///< Done before, or found.
  std::vector<std::string> problems;  ///< Why steps are not done, with the last lines of programs.
  bool stopped = false;               ///< By a signal; what was done is kept.
};

/// Runs the steps that are not done, in order; each writes its record below `results` when it is.
/// With `again` also those that are. A step that fails loses its record unless it failed before it
/// wrote anything beside its outputs; those that need it are not run, the others are. A signal is
/// passed on to the running program, a second one ends it at once; no further step is begun. Throws
/// std::runtime_error if nothing can be written to `results`.
[[nodiscard]] StepsOutcome run_steps(const std::vector<Step>& steps,
                                     const std::filesystem::path& results, bool again,
                                     SignalWatch& signals, StepDisplay& display);

}  // namespace km
