#define CATCH_CONFIG_EXTERNAL_INTERFACES
#include <catch2/catch.hpp>
#include <iostream>

#include "test/support/processor_use.hpp"

// Prints the kernel's share of the times below each benchmark.
// different machines, so that a time alone does not show them.

namespace km {
namespace {

class KernelShares final : public Catch::TestEventListenerBase {
 public:
  using TestEventListenerBase::TestEventListenerBase;

  void benchmarkStarting(const Catch::BenchmarkInfo& /*info*/) override {
    before_ = processor_use();
  }
  void benchmarkEnded(const Catch::BenchmarkStats<>& stats) override {
    const double runs = static_cast<double>(stats.info.iterations) * stats.info.samples;
    std::cout << "  each run: " << kernel_share(before_, runs) << '\n';
  }

 private:
  ProcessorUse before_;
};

CATCH_REGISTER_LISTENER(KernelShares)

}  // namespace
}  // namespace km
