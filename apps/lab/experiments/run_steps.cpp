#include "apps/lab/experiments/run_steps.hpp"

#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <ctime>
#include <deque>
#include <iostream>
#include <optional>
#include <set>
#include <utility>

#include "apps/lab/experiments/step_record.hpp"
#include "apps/output_file.hpp"
#include "apps/program_version.hpp"
#include "apps/team/robot_process.hpp"
#include "modules/core/text_table.hpp"
#include "runtime/clock.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr double kQuiet_s = 2.0;  // shorter steps show only their end
constexpr double kRedrawInterval_s = 0.2;
constexpr int kPoll_ms = 100;
constexpr std::size_t kLastLines = 12;
constexpr const char* kLogHint = "\n    (complete output: ";

std::string duration(double seconds) {
  const auto s = static_cast<long>(std::lround(seconds));
  if (s < 10) return fixed(seconds, 1) + " s";
  if (s < 60) return std::to_string(s) + " s";
  if (s < 3600) return std::to_string(s / 60) + " min " + std::to_string(s % 60) + " s";
  return std::to_string(s / 3600) + " h " + std::to_string(s / 60 % 60) + " min";
}

// "about 12 min", "less than a minute".
std::string rough_duration(double seconds) {
  const auto minutes = static_cast<long>(std::ceil(seconds / 60.0));
  if (minutes <= 1) return "less than a minute";
  if (minutes < 90) return "about " + std::to_string(minutes) + " min";
  return "about " + fixed(seconds / 3600.0, 1) + " h";
}

std::string now_text() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%d %H:%M UTC", &utc);
  return text;
}

// Files beside the outputs of a step, with the time of their last change.
std::map<fs::path, fs::file_time_type> written(const Step& step) {
  std::map<fs::path, fs::file_time_type> times;
  std::error_code error;  // missing folders and files must not throw
  for (const fs::path& output : step.outputs)
    for (const auto& file : fs::directory_iterator(fs::absolute(output).parent_path(), error)) {
      if (!file.is_regular_file(error)) continue;  // records are written in a folder beside them
      if (const auto time = file.last_write_time(error); !error) times[file.path()] = time;
    }
  return times;
}

class StepsRun {
 public:
  StepsRun(const std::vector<Step>& steps, const fs::path& results, bool again,
           SignalWatch& signals, StepDisplay& display)
      : steps_(steps), results_(results), again_(again), signals_(signals), display_(display) {
    fs::create_directories(results / "logs");
    std::vector<StepDisplay::ExpectedStep> expected;
    for (const Step& step : steps)
      expected.push_back({step.title, step.command.front(), estimate_s(step)});
    display.expect(std::move(expected));
  }

  StepsOutcome run() {
    for (std::size_t i = 0; i < steps_.size() && !outcome_.stopped; ++i) {
      const Step& step = steps_[i];
      if (const auto failure = failure_before(step)) {
        failure_of_[step.name] = *failure;
        held_up_[*failure] += (held_up_[*failure].empty() ? "" : ", ") + step.name;
        continue;
      }
      const StepState state = state_of(step, results_);
      if (state == StepState::kMissing)
        fail(step, step.missing);
      else if (state == StepState::kFound)
        adopt(step);
      else if (state == StepState::kDone && !again_)
        ++outcome_.kept;
      else
        make(i);
    }
    for (const auto& [failure, steps] : held_up_)
      outcome_.problems.push_back("not run, as " + failure + " is not done: " + steps);
    return std::move(outcome_);
  }

 private:
  // Time of the last run of the step, or the expected one; 0 if the step will not run.
  double estimate_s(const Step& step) {
    const StepState state = state_of(step, results_);
    if (state == StepState::kMissing) return 0.0;
    const bool waits =
        std::any_of(step.needs.begin(), step.needs.end(),
                    [&](const std::string& need) { return pending_.contains(need); });
    if ((state == StepState::kDone || state == StepState::kFound) && !again_ && !waits) return 0.0;
    pending_.insert(step.name);
    const auto record = read_record(results_, step.name);
    return record && record->seconds > 0.0 ? record->seconds : step.expected_s;
  }

  // The failed step that prevents `step`.
  std::optional<std::string> failure_before(const Step& step) const {
    for (const std::string& need : step.needs)
      if (const auto found = failure_of_.find(need); found != failure_of_.end())
        return found->second;
    return std::nullopt;
  }

  // Consecutive steps that fail for the same reason, for instance all methods on one graph, share a
  // message.
  void fail(const Step& step, const std::string& why) {
    failure_of_[step.name] = step.name;
    const std::string reason = why.substr(0, why.find(kLogHint));
    if (reason == last_reason_) {
      std::string& problem = outcome_.problems.back();
      problem.insert(problem.find(": "), ", " + step.name);
      return;
    }
    last_reason_ = reason;
    outcome_.problems.push_back(step.name + ": " + why);
  }

  void adopt(const Step& step) {
    write_record(results_, {.step = step.name,
                            .fingerprint = fingerprint_of(step),
                            .command = {},
                            .started = now_text(),
                            .commit = built_commit(),
                            .machine = this_machine()});
    ++outcome_.kept;
  }

  // A record without a fingerprint marks the existing outputs as invalid.
  void prepare(const Step& step, const StepRecord& begun) const {
    write_record(results_, begun);
    for (const fs::path& output : step.outputs)
      if (output.has_parent_path()) fs::create_directories(output.parent_path());
    for (const auto& [from, to] : step.copies) {
      fs::create_directories(to.parent_path());
      fs::copy_file(from, to, fs::copy_options::overwrite_existing);
    }
    for (const auto& [file, text] : step.writes) {
      fs::create_directories(file.parent_path());
      write_output(file, [&](std::ostream& out) { out << text; });
    }
  }

  void make(std::size_t index) {
    const Step& step = steps_[index];
    StepRecord record{.step = step.name,
                      .command = step.command,
                      .started = now_text(),
                      .commit = built_commit(),
                      .machine = this_machine()};
    const auto earlier = read_record(results_, step.name);
    const auto written_before = written(step);
    const double start_s = steady_now_s();
    display_.start(index, start_s);
    std::string problem;
    try {
      prepare(step, record);
      record.fingerprint = fingerprint_of(
          step);  // before the command: later changes of the inputs make the result outdated
      problem = run_command(step);
    } catch (const std::exception& error) {
      problem = error.what();
    }
    record.seconds = steady_now_s() - start_s;
    if (problem.empty()) {
      write_record(results_, record);
      ++outcome_.made;
    } else {
      // If no file was changed, the earlier record is still valid.
      if (earlier && written(step) == written_before) write_record(results_, *earlier);
      fail(step, problem);
    }
    display_.finish(problem.empty()    ? "done"
                    : outcome_.stopped ? "stopped"
                                       : "FAILED",
                    steady_now_s());
  }

  // Runs the program of a step. Returns the reason of its failure; empty if it succeeded and made
  // its outputs.
  std::string run_command(const Step& step) {
    const fs::path log = results_ / "logs" / (step.name + ".log");
    if (access(step.command.front().c_str(), X_OK) != 0)
      return "no such program: " + step.command.front() + "; build it";
    RobotProcess process(step.command, signals_.previous(), log);
    std::deque<std::string> last_lines;
    while (!process.exit()) {
      const auto fds = process.descriptors();
      pollfd polled[] = {{fds[0], POLLIN, 0}, {fds[1], POLLIN, 0}};
      poll(polled, 2, kPoll_ms);
      for (std::string& line : process.read())
        if (!line.empty()) last_lines.push_back(std::move(line));
      while (last_lines.size() > kLastLines) last_lines.pop_front();
      if (signals_.wait(0.0)) {
        process.send(outcome_.stopped ? SIGKILL : SIGINT);
        outcome_.stopped = true;
      }
      display_.update(last_lines.empty() ? "" : last_lines.back(), steady_now_s());
    }
    if (outcome_.stopped) return "stopped; the same command continues";
    std::string problem;
    if (!process.exit()->ok())
      problem = to_string(*process.exit());
    else
      for (const fs::path& output : step.outputs)
        if (problem.empty() && !fs::exists(output)) problem = "it made no " + output.string();
    if (problem.empty()) return {};
    // Not every program prints its error to standard error.
    for (const auto& words :
         process.last_log_lines().empty() ? last_lines : process.last_log_lines())
      problem += "\n    " + words;
    return problem + kLogHint + log.string() + ')';
  }

  const std::vector<Step>& steps_;
  const fs::path& results_;
  bool again_;
  SignalWatch& signals_;
  StepDisplay& display_;
  std::set<std::string> pending_;                  // steps to be run, for the remaining time
  std::map<std::string, std::string> failure_of_;  // by step: the failed step that prevents it
  std::map<std::string, std::string>
      held_up_;              // by failed step: names of the steps that it prevents
  std::string last_reason_;  // reason of the last failure
  StepsOutcome outcome_;
};

}  // namespace

StepDisplay StepDisplay::standard_output() {
  winsize size{};
  const bool known = ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
  return {std::cout, isatty(STDOUT_FILENO) == 1, known ? size.ws_col : 80};
}

void StepDisplay::start(std::size_t index, double now_s) {
  index_ = index;
  start_s_ = drawn_s_ = now_s;
}

double StepDisplay::expected_s(std::size_t index) const {
  const auto& [title, program, estimate_s] = steps_.at(index);
  const auto pace = paces_.find(program);
  if (pace == paces_.end() || !(pace->second.estimate_s > 0.0)) return estimate_s;
  return estimate_s * pace->second.took_s / pace->second.estimate_s;
}

std::string StepDisplay::heading() const {
  return '[' + std::to_string(index_ + 1) + '/' + std::to_string(steps_.size()) + "] " +
         steps_.at(index_).title;
}

std::string StepDisplay::text(const std::string& line, double now_s) const {
  const double elapsed_s = now_s - start_s_;
  double later_s = 0.0;
  for (std::size_t k = index_ + 1; k < steps_.size(); ++k) later_s += expected_s(k);
  // A step that takes longer than expected may end soon or late, so no time is shown.
  const std::string left =
      elapsed_s <= expected_s(index_)
          ? rough_duration(expected_s(index_) - elapsed_s + later_s) + " left"
          : "longer than expected" + (later_s > 0.0 ? ", then " + rough_duration(later_s) : "");
  return heading() + ": " + duration(elapsed_s) + ", " + left +
         (line.empty() ? std::string() : " | " + line);
}

void StepDisplay::update(const std::string& line, double now_s) {
  if (now_s - start_s_ < kQuiet_s) return;
  if (now_s - drawn_s_ < (terminal_ ? kRedrawInterval_s : kPlainInterval_s)) return;
  drawn_s_ = now_s;
  if (terminal_)
    output_ << "\r\x1b[K"
            << text(line, now_s).substr(0, static_cast<std::size_t>(std::max(width_, 20) - 1))
            << std::flush;
  else
    output_ << text(line, now_s) << std::endl;
}

void StepDisplay::finish(const std::string& result, double now_s) {
  output_ << (terminal_ ? "\r\x1b[K" : "") << heading() << ": " << result << " in "
          << duration(now_s - start_s_) << std::endl;
  if (result != "done") return;  // the duration of an unfinished step predicts nothing
  const auto& [title, program, estimate_s] = steps_.at(index_);
  Pace& pace = paces_[program];
  pace.took_s += now_s - start_s_;
  pace.estimate_s += estimate_s;
}

StepsOutcome run_steps(const std::vector<Step>& steps, const fs::path& results, bool again,
                       SignalWatch& signals, StepDisplay& display) {
  return StepsRun(steps, results, again, signals, display).run();
}

}  // namespace km
