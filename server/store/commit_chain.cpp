#include "server/store/commit_chain.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <span>
#include <utility>

#include "common/base/file.h"

namespace lightmill {
namespace {

constexpr std::uint64_t kMagic = 0x31'6e'69'61'68'63'4d'4c;  // "LMchain1"
constexpr off_t kSlotBytes = 4096;

/// A slot as it is in the file. It has no padding.
struct Slot {
  std::uint64_t magic = kMagic;
  std::array<std::uint8_t, 16> store{};
  std::uint64_t commits = 0, hash_high = 0, hash_low = 0, highest_job = 0;
  std::uint64_t checksum = 0;  ///< low word of the XXH3-128 of the fields above
};
static_assert(sizeof(Slot) == 64);

std::uint64_t checksum_of(const Slot& slot) {
  Xxh3Hasher hasher;
  hasher.append(std::as_bytes(std::span(&slot, 1)).first(offsetof(Slot, checksum)));
  return hasher.finish().low;
}

std::optional<CommitMark> read_slot(int file, int number) {
  Slot slot;
  if (::pread(file, &slot, sizeof(slot), number * kSlotBytes) != sizeof(slot) || slot.magic != kMagic ||
      slot.checksum != checksum_of(slot)) {
    return std::nullopt;
  }
  return CommitMark{slot.store, slot.commits, {slot.hash_high, slot.hash_low}, slot.highest_job};
}

}  // namespace

Result<CommitChain> CommitChain::open(const std::filesystem::path& path) {
  const int file = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (file < 0) {
    return unavailable("cannot open {}: {}", path.string(), std::strerror(errno));
  }
  give_to_owner_of_folder(file, path);
  CommitChain chain(path, file);
  for (const int number : {0, 1}) {
    const std::optional<CommitMark> mark = read_slot(file, number);
    if (mark && (!chain.last_ || mark->commits > chain.last_->commits)) {
      chain.last_ = mark;
    }
  }
  return chain;
}

CommitChain::CommitChain(CommitChain&& other) noexcept
    : path_(std::move(other.path_)), file_(std::exchange(other.file_, -1)), last_(std::move(other.last_)) {}

CommitChain& CommitChain::operator=(CommitChain&& other) noexcept {
  std::swap(path_, other.path_);
  std::swap(file_, other.file_);
  std::swap(last_, other.last_);
  return *this;
}

CommitChain::~CommitChain() {
  if (file_ >= 0) {
    ::close(file_);
  }
}

Status CommitChain::append(const CommitMark& mark) {
  Slot slot;
  slot.store = mark.store;
  slot.commits = mark.commits;
  slot.hash_high = mark.hash.high;
  slot.hash_low = mark.hash.low;
  slot.highest_job = mark.highest_job;
  slot.checksum = checksum_of(slot);
  const off_t at = static_cast<off_t>(mark.commits % 2) * kSlotBytes;
  if (::pwrite(file_, &slot, sizeof(slot), at) != sizeof(slot) || ::fdatasync(file_) != 0) {
    return make_error(errno == ENOSPC || errno == EDQUOT ? StatusCode::kResourceExhausted : StatusCode::kUnavailable,
                      "cannot write {}: {}", path_.string(), std::strerror(errno));
  }
  last_ = mark;
  return ok_status();
}

Status CommitChain::restart(const CommitMark& mark) {
  const Slot none{.magic = 0};
  const off_t other = static_cast<off_t>((mark.commits + 1) % 2) * kSlotBytes;
  if (::pwrite(file_, &none, sizeof(none), other) != sizeof(none)) {
    return unavailable("cannot write {}: {}", path_.string(), std::strerror(errno));
  }
  return append(mark);
}

Status check_shared_chain(const std::optional<CommitMark>& chain, const CommitMark& store) {
  if (chain && chain->store != store.store) {
    return failed_precondition("the commit chain belongs to another store");
  }
  if (chain && store.commits < chain->commits) {
    return failed_precondition(
        "its last commit is {}, but commits up to {} were acknowledged. Jobs up to {} and their results may be lost",
        store.commits, chain->commits, chain->highest_job);
  }
  return ok_status();
}

Status check_chain(const std::optional<CommitMark>& chain, const CommitMark& store) {
  if (!chain) {
    return store.commits <= 1
               ? ok_status()  // killed before its first mark, so nothing was acknowledged
               : failed_precondition("the commit chain is missing or damaged, so the database may have lost commits");
  }
  LM_RETURN_IF_ERROR(check_shared_chain(chain, store));
  if (store.commits > chain->commits + 1) {
    return failed_precondition("its last commit is {}, but the commit chain is older: it ends at {}", store.commits,
                               chain->commits);
  }
  if (store.commits == chain->commits && store.hash != chain->hash) {
    return failed_precondition("its writes up to commit {} differ from the acknowledged ones", store.commits);
  }
  return ok_status();
}

}  // namespace lightmill
