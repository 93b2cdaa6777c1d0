# 32-bit ARM Linux (ARMv7, hard floats) from an x86-64 Debian 12: cmake --preset armhf, or
# -DCMAKE_TOOLCHAIN_FILE=toolchains/this file. Compiler and emulator are the host's packages, libraries those of
# Debian armhf under BURIN_SYSROOT, where toolchains/sysroot.sh puts them; ./dev cross armhf does both.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR armv7l)
set(triple arm-linux-gnueabihf)
set(CMAKE_C_COMPILER ${triple}-gcc)
set(CMAKE_CXX_COMPILER ${triple}-g++)
# Else GCC remarks on every call that GCC 6 would have passed otherwise; nothing here was built with that.
set(CMAKE_CXX_FLAGS_INIT -Wno-psabi)

set(BURIN_SYSROOT ${CMAKE_CURRENT_LIST_DIR}/../build/sysroot/armhf CACHE PATH "Libraries and headers of the target")
cmake_path(ABSOLUTE_PATH BURIN_SYSROOT NORMALIZE OUTPUT_VARIABLE CMAKE_SYSROOT)
set(CMAKE_TRY_COMPILE_PLATFORM_VARIABLES BURIN_SYSROOT)
set(CMAKE_LIBRARY_ARCHITECTURE ${triple})

# Nothing of the host but programs.
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
foreach(kind LIBRARY INCLUDE PACKAGE)
  set(CMAKE_FIND_ROOT_PATH_MODE_${kind} ONLY)
endforeach()

# NEON of ARMv7 is not IEEE 754 (README.md): the scalar kernels keep the bits.
set(BURIN_SCALAR_ONLY ON CACHE BOOL "Build the scalar kernels only")

# pkg-config too, else it finds this machine's.
set(ENV{PKG_CONFIG_LIBDIR} ${CMAKE_SYSROOT}/usr/lib/${triple}/pkgconfig:${CMAKE_SYSROOT}/usr/share/pkgconfig)
set(ENV{PKG_CONFIG_SYSROOT_DIR} ${CMAKE_SYSROOT})

# Tests run through it. QEMU_CPU chooses the model, cortex-a7 or cortex-a15 for instance.
set(CMAKE_CROSSCOMPILING_EMULATOR qemu-arm -L ${CMAKE_SYSROOT})
