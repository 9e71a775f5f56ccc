// Numbers for people: times, counts and rates with fitting units, and the parsers of typed values.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "common/base/clock.h"
#include "common/base/number_text.h"
#include "common/base/status.h"
#include "common/film/tile_grid.h"

namespace lightmill::cli {

inline constexpr std::int64_t kDaySeconds = 24 * 60 * 60;

/// Seconds since 1970 by this machine's clock.
inline std::int64_t now_unix_s() {
  return system_clock().unix_milliseconds() / 1000;
}

/// The two largest units: "0.4 s", "12 s", "3 min 05 s", "2 h 03 min", "4 d 03 h"; "?" for negative (unknown) times.
std::string human_seconds(double seconds);
/// A time with one unit, for tables: "14 min", "2.1 h".
std::string rough_seconds(double seconds);

/// Three significant digits and a metric prefix: "950", "1.23 k", "45.6 M".
std::string human_count(double count);

/// "950 samples/s", "45.6 Msamples/s".
std::string human_rate(double samples_per_second);

/// "2026-11-21 08:15" in local time; "-" for 0.
std::string human_date(std::int64_t unix_ms);
/// "2026-11-26". On the day of `now_ms` it is the time: "01:13".
std::string human_day(std::int64_t unix_ms, std::int64_t now_ms = 0);
/// "2026-11-26 01:13:05+0100"; local time, as human_date.
std::string human_moment(std::int64_t unix_ms);

/// "WxH", each a film's side.
Result<std::pair<int, int>> parse_size(std::string_view text);

/// "X,Y,W,H" in pixels of the full film.
Result<PixelRect> parse_crop(std::string_view text);

/// `text` as a whole number in decimal digits from `least` to `most`. INVALID_ARGUMENT says what is allowed.
Result<std::int64_t> parse_whole(std::string_view text, std::int64_t least, std::int64_t most);
Result<std::uint64_t> parse_whole(std::string_view text, std::uint64_t least, std::uint64_t most);

/// A finite number from `least` to `most`.
Result<double> parse_real(std::string_view text, double least, double most);

/// A relMSE as a goal: positive.
Result<double> parse_error(std::string_view text);

/// A share: "1%", "0.5%", "all" (1), "none" (0).
Result<double> parse_share(std::string_view text);

/// Seconds from "90", "90s", "1.5m", "2h", "1d" or "1w".
Result<double> parse_time(std::string_view text);

/// The same for a job's limit, as check_goal_seconds allows.
Result<double> parse_seconds(std::string_view text);

}  // namespace lightmill::cli
