#include "library_pages.hpp"

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <system_error>
#include <vector>

#include <fcntl.h>
#include <link.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace viwo {
namespace {

/// Whole pages.
struct Pages {
  std::uintptr_t begin = 0;
  std::size_t size = 0;
  int protection = PROT_NONE;
  /// What /proc/self/maps says is a number.
  void* data() const {
    return reinterpret_cast<void*>(begin);  // NOLINT(performance-no-int-to-ptr)
  }
};

struct MappedLibrary {
  std::uintptr_t inside = 0;
  std::vector<Pages> of_file;    ///< what the loader has mapped
  std::vector<Pages> read_only;  ///< what it has protected when it was relocated
};

Pages whole_pages(std::uintptr_t begin, std::size_t size, bool inward) {
  const auto page = static_cast<std::uintptr_t>(::sysconf(_SC_PAGESIZE));
  const std::uintptr_t first = begin / page * page;
  const std::uintptr_t end = (begin + size + (inward ? 0 : page - 1)) / page * page;
  return {first, end > first ? end - first : 0};
}

int protection_of(std::uint32_t flags) {
  return ((flags & PF_R) != 0 ? PROT_READ : 0) | ((flags & PF_W) != 0 ? PROT_WRITE : 0) |
         ((flags & PF_X) != 0 ? PROT_EXEC : 0);
}

/// For dl_iterate_phdr(): 1 for the library that is looked for.
int find_library(dl_phdr_info* info, std::size_t /*size*/, void* data) {
  MappedLibrary& library = *static_cast<MappedLibrary*>(data);
  library.of_file.clear();
  library.read_only.clear();
  bool is_it = false;
  for (std::size_t i = 0; i < info->dlpi_phnum; ++i) {
    const auto& segment = info->dlpi_phdr[i];
    const std::uintptr_t begin = info->dlpi_addr + segment.p_vaddr;
    if (segment.p_type == PT_GNU_RELRO) {
      library.read_only.push_back(whole_pages(begin, segment.p_memsz, true));
    }
    if (segment.p_type != PT_LOAD) continue;
    is_it = is_it || (library.inside >= begin && library.inside < begin + segment.p_memsz);
    library.of_file.push_back(whole_pages(begin, segment.p_filesz, false));
    library.of_file.back().protection = protection_of(segment.p_flags);
  }
  return is_it ? 1 : 0;
}

[[noreturn]] void fail() { throw std::system_error(errno, std::generic_category()); }

class MemoryFile {
 public:
  MemoryFile() : fd_(::memfd_create("viwo-plugin", MFD_CLOEXEC | MFD_ALLOW_SEALING)) {
    if (fd_ < 0) fail();
  }
  ~MemoryFile() { ::close(fd_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  void append(const Pages& pages) {
    for (std::size_t done = 0; done < pages.size;) {
      // Not write(): the address sanitizer would see it read what guards the globals in them.
      const long n = ::syscall(SYS_write, fd_, static_cast<const char*>(pages.data()) + done,
                               pages.size - done);
      if (n < 0 && errno == EINTR) continue;
      if (n < 0) fail();
      done += static_cast<std::size_t>(n);
    }
  }
  void seal() {
    if (::fcntl(fd_, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_WRITE | F_SEAL_SEAL) != 0) {
      fail();
    }
  }
  /// In place of what is there.
  void map(const Pages& pages, off_t offset) const {
    if (pages.size == 0) return;
    if (::mmap(pages.data(), pages.size, pages.protection, MAP_PRIVATE | MAP_FIXED, fd_, offset) ==
        MAP_FAILED) {
      fail();
    }
  }

 private:
  int fd_;
};

/// The loader knows libraries by their inodes. That of a file which is removed is given to another
/// one, unless a page is mapped: one that nobody touches.
void keep_inode(const std::filesystem::path& file) {
  const int fd = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) fail();
  const void* const page = ::mmap(nullptr, 1, PROT_NONE, MAP_PRIVATE, fd, 0);
  const int error = errno;
  ::close(fd);
  errno = error;
  if (page == MAP_FAILED) fail();
}

}  // namespace

void keep_pages_of(const void* inside, const std::filesystem::path& file) {
  keep_inode(file);
  MappedLibrary library;
  library.inside = reinterpret_cast<std::uintptr_t>(inside);
  if (::dl_iterate_phdr(find_library, &library) != 1) return;
  MemoryFile copy;
  for (const Pages& pages : library.of_file) copy.append(pages);
  copy.seal();
  off_t offset = 0;
  for (const Pages& pages : library.of_file) {
    copy.map(pages, offset);
    offset += static_cast<off_t>(pages.size);
  }
  for (const Pages& pages : library.read_only) {
    if (pages.size > 0 && ::mprotect(pages.data(), pages.size, PROT_READ) != 0) fail();
  }
}

}  // namespace viwo
