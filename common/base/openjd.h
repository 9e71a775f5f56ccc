// Lines that report a task's progress and status to a farm manager. OpenCue, Deadline and others read them from its
// standard output. Source: Open Job Description, "How Jobs Are Run", "Stdout/Stderr Messages".
#pragma once

#include <string>
#include <string_view>

namespace lightmill {

/// "openjd_progress: 12.5". `fraction` is in [0, 1].
std::string openjd_progress(double fraction);
/// "openjd_status: ...", on one line.
std::string openjd_status(std::string_view text);
/// "openjd_fail: ...", on one line: why the task failed.
std::string openjd_fail(std::string_view text);

/// From now on, log messages of level info and above also go to standard output, as the task's status.
void log_as_openjd_status();

}  // namespace lightmill
