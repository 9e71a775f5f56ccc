// The share of CPU time inside Embree's code.
#pragma once

#include <link.h>
#include <sys/time.h>
#include <ucontext.h>

#include <csignal>
#include <cstdint>
#include <string_view>

namespace lightmill {

/// Samples the program counter every millisecond of CPU time, and counts samples inside Embree. Only one may exist,
/// because the process has one timer.
class EmbreeShare {
 public:
  EmbreeShare() {
    total_ = 0;
    inside_ = 0;
    dl_iterate_phdr(
        [](dl_phdr_info* info, std::size_t, void*) {
          if (std::string_view(info->dlpi_name).find("libembree") != std::string_view::npos) {
            for (int i = 0; i < info->dlpi_phnum; ++i) {
              const auto& header = info->dlpi_phdr[i];
              if (header.p_type == PT_LOAD && (header.p_flags & PF_X) != 0) {
                first_ = info->dlpi_addr + header.p_vaddr;
                last_ = first_ + header.p_memsz;
              }
            }
          }
          return 0;
        },
        nullptr);
    struct sigaction action {};
    action.sa_sigaction = [](int, siginfo_t*, void* context) {
      const auto pc = static_cast<std::uintptr_t>(static_cast<ucontext_t*>(context)->uc_mcontext.gregs[REG_RIP]);
      total_ = total_ + 1;
      inside_ = inside_ + (pc >= first_ && pc < last_ ? 1 : 0);
    };
    action.sa_flags = SA_SIGINFO | SA_RESTART;
    sigaction(SIGPROF, &action, nullptr);
  }
  void start() { set_timer(1000); }
  void stop() { set_timer(0); }
  double percent() const { return total_ > 0 ? 100.0 * static_cast<double>(inside_) / static_cast<double>(total_) : 0; }

 private:
  static void set_timer(int microseconds) {
    const itimerval timer{{0, microseconds}, {0, microseconds}};
    setitimer(ITIMER_PROF, &timer, nullptr);
  }
  static inline std::uintptr_t first_ = 0, last_ = 0;
  static inline volatile std::sig_atomic_t total_ = 0, inside_ = 0;
};

}  // namespace lightmill
