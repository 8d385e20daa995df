#include "apps/experiments/run_steps.hpp"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <ctime>
#include <deque>
#include <map>
#include <optional>
#include <set>

#include "apps/experiments/step_record.hpp"
#include "apps/experiments/step_times.hpp"
#include "apps/output_file.hpp"
#include "apps/team/robot_process.hpp"
#include "runtime/clock.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr int kPoll_ms = 100;
constexpr std::size_t kLastLines = 12;
constexpr const char* kLogHint = "\n    (all it said: ";

std::string now_text() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%d %H:%M UTC", &utc);
  return text;
}

// The files beside those that a step makes, and when each was last written.
std::map<fs::path, fs::file_time_type> written(const Step& step) {
  std::map<fs::path, fs::file_time_type> times;
  std::error_code error;  // of folders and files that are not there (any more)
  for (const fs::path& output : step.outputs)
    for (const auto& file : fs::directory_iterator(fs::absolute(output).parent_path(), error))
      if (const auto time = file.last_write_time(error); !error) times[file.path()] = time;
  return times;
}

class StepsRun {
 public:
  StepsRun(const std::vector<Step>& steps, const fs::path& results, bool again,
           SignalWatch& signals, StepDisplay& display)
      : steps_(steps), results_(results), again_(again), signals_(signals), display_(display) {
    fs::create_directories(results / "logs");
    for (const Step& step : steps) times_.add(step.command.front(), thought_s(step));
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
  // What it took last time, or what is thought of it; nothing if it is done.
  double thought_s(const Step& step) {
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

  // The step whose failure holds up `step`.
  std::optional<std::string> failure_before(const Step& step) const {
    for (const std::string& need : step.needs)
      if (const auto found = failure_of_.find(need); found != failure_of_.end())
        return found->second;
    return std::nullopt;
  }

  // Steps that fail for one reason in a row, all methods on one graph say, share a message.
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

  // The record without a fingerprint says that what there is now is not the result.
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
    display_.start(index + 1, steps_.size(), step.title, times_.expected_s(index),
                   times_.later_s(index), start_s);
    std::string problem;
    try {
      prepare(step, record);
      record.fingerprint =
          fingerprint_of(step);  // before: what changes meanwhile counts as changed
      problem = run_command(step);
    } catch (const std::exception& error) {
      problem = error.what();
    }
    record.seconds = steady_now_s() - start_s;
    if (problem.empty()) {
      write_record(results_, record);
      times_.note(index, record.seconds);
      ++outcome_.made;
    } else {
      // What was not touched still is what the earlier record says.
      if (earlier && written(step) == written_before) write_record(results_, *earlier);
      fail(step, problem);
    }
    display_.finish(problem.empty()    ? "done"
                    : outcome_.stopped ? "stopped"
                                       : "FAILED",
                    steady_now_s());
  }

  // Empty if the program ended well and made its outputs.
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
    if (outcome_.stopped) return "stopped; the same command goes on";
    std::string problem;
    if (!process.exit()->ok())
      problem = to_string(*process.exit());
    else
      for (const fs::path& output : step.outputs)
        if (problem.empty() && !fs::exists(output)) problem = "it made no " + output.string();
    if (problem.empty()) return {};
    // Not every program says what is wrong on standard error.
    for (const auto& words : process.last_words().empty() ? last_lines : process.last_words())
      problem += "\n    " + words;
    return problem + kLogHint + log.string() + ')';
  }

  const std::vector<Step>& steps_;
  const fs::path& results_;
  bool again_;
  SignalWatch& signals_;
  StepDisplay& display_;
  StepTimes times_;
  std::set<std::string> pending_;                  // steps that will be run, for the time left
  std::map<std::string, std::string> failure_of_;  // step: the one whose failure holds it up
  std::map<std::string, std::string> held_up_;     // that one: the names of those it holds up
  std::string last_reason_;                        // of the last failure
  StepsOutcome outcome_;
};

}  // namespace

StepsOutcome run_steps(const std::vector<Step>& steps, const fs::path& results, bool again,
                       SignalWatch& signals, StepDisplay& display) {
  return StepsRun(steps, results, again, signals, display).run();
}

}  // namespace km
