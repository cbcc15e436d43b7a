# Toolchain: Debian's compiler for arm64, with the libraries of the system in VIWO_SYSROOT, and qemu to
# run what is built. scripts/arm64.sh makes such a system and calls cmake with this file.
set(CMAKE_TRY_COMPILE_PLATFORM_VARIABLES VIWO_SYSROOT)
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_LIBRARY_ARCHITECTURE aarch64-linux-gnu)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_SYSROOT ${VIWO_SYSROOT})
set(CMAKE_CROSSCOMPILING_EMULATOR qemu-aarch64-static -L ${VIWO_SYSROOT})
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
foreach(kind LIBRARY INCLUDE PACKAGE)
  set(CMAKE_FIND_ROOT_PATH_MODE_${kind} ONLY)
endforeach()
# pkg-config knows of no system but this machine's.
set(ENV{PKG_CONFIG_LIBDIR} ${VIWO_SYSROOT}/usr/lib/aarch64-linux-gnu/pkgconfig:${VIWO_SYSROOT}/usr/share/pkgconfig)
set(ENV{PKG_CONFIG_SYSROOT_DIR} ${VIWO_SYSROOT})
