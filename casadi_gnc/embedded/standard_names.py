"""Words that are taken: keywords of C and C++, macros, headers and functions of libraries, targets of build systems.

From ISO C99, C11 and C23, ISO C++20, POSIX.1-2017 (its common functions), and the manuals of CMake and make.
"""

from __future__ import annotations

_C = """auto break case char const continue default do double else enum extern float for goto if inline int long
register restrict return short signed sizeof static struct switch typedef union unsigned void volatile while
typeof typeof_unqual _Bool _Complex _Imaginary _Alignas _Alignof _Atomic _Generic _Noreturn _Static_assert
_Thread_local"""
_CPP = """alignas alignof and and_eq asm bitand bitor bool catch char8_t char16_t char32_t class co_await co_return
co_yield compl concept consteval constexpr constinit const_cast decltype delete dynamic_cast explicit export
false friend mutable namespace new noexcept not not_eq nullptr operator or or_eq private protected public
reinterpret_cast requires static_assert static_cast template this thread_local throw true try typeid typename
using virtual wchar_t xor xor_eq"""
#: Words that no name may be.
KEYWORDS = frozenset((_C + " " + _CPP).split())

_MACROS = """NULL EOF I complex imaginary errno assert stdin stdout stderr noreturn offsetof setjmp va_start va_arg
va_end
va_copy NAN INFINITY HUGE_VAL HUGE_VALF HUGE_VALL FP_NAN FP_INFINITE FP_ZERO FP_SUBNORMAL FP_NORMAL FP_ILOGB0
FP_ILOGBNAN MATH_ERRNO MATH_ERREXCEPT math_errhandling M_E M_LOG2E M_LOG10E M_LN2 M_LN10 M_PI M_PI_2 M_PI_4
M_1_PI M_2_PI M_2_SQRTPI M_SQRT2 M_SQRT1_2 RAND_MAX EXIT_SUCCESS EXIT_FAILURE MB_CUR_MAX BUFSIZ FILENAME_MAX
FOPEN_MAX L_tmpnam SEEK_CUR SEEK_END SEEK_SET TMP_MAX CLOCKS_PER_SEC TIME_UTC EDOM ERANGE EILSEQ CHAR_BIT
CHAR_MAX CHAR_MIN INT_MAX INT_MIN LONG_MAX LONG_MIN LLONG_MAX LLONG_MIN SCHAR_MAX SCHAR_MIN SHRT_MAX SHRT_MIN
UCHAR_MAX UINT_MAX ULONG_MAX ULLONG_MAX USHRT_MAX INT8_MAX INT8_MIN INT16_MAX INT16_MIN INT32_MAX INT32_MIN
INT64_MAX INT64_MIN UINT8_MAX UINT16_MAX UINT32_MAX UINT64_MAX INT8_C INT16_C INT32_C INT64_C UINT8_C UINT16_C
UINT32_C UINT64_C SIZE_MAX INTPTR_MAX INTPTR_MIN UINTPTR_MAX INTMAX_MAX INTMAX_MIN UINTMAX_MAX PTRDIFF_MAX
PTRDIFF_MIN WCHAR_MAX WCHAR_MIN DBL_DIG DBL_EPSILON DBL_MANT_DIG DBL_MAX DBL_MIN DBL_TRUE_MIN FLT_DIG
FLT_EPSILON FLT_EVAL_METHOD FLT_MANT_DIG FLT_MAX FLT_MIN FLT_RADIX FLT_ROUNDS FLT_TRUE_MIN LDBL_MAX LDBL_MIN
LDBL_EPSILON DECIMAL_DIG SIGABRT SIGFPE SIGILL SIGINT SIGSEGV SIGTERM SIG_DFL SIG_ERR SIG_IGN TRUE FALSE linux
unix i386 mips sparc sun vax arm near far pascal huge interface"""
#: Macros without arguments, of headers and of compilers in their own dialects (gcc's `linux` is 1).
MACROS = frozenset(_MACROS.split())

_HEADERS = """assert complex ctype errno fenv float inttypes iso646 limits locale math setjmp signal stdalign stdarg
stdatomic stdbit stdbool stdckdint stddef stdint stdio stdlib stdnoreturn string tgmath threads time uchar
wchar wctype aio aliases alloca ar argp argz byteswap cpio crypt dirent dlfcn elf endian envz err error
execinfo fcntl features fmtmsg fnmatch fstab fts ftw getopt glob grp iconv ieee754 ifaddrs langinfo libgen
libintl link mcheck malloc memory mntent monetary mqueue ndbm netdb newlib nl_types nss obstack paths poll
printf pthread pty pwd re_comp regex regexp resolv sched search semaphore sgtty shadow spawn stab stropts
strings syscall sysexits syslog tar termio termios thread_db ttyent ucontext ulimit unistd utime utmp utmpx
values wait wordexp xlocale reent envlock windows crtdefs vcruntime corecrt yvals sal vadefs eh io conio
direct process intrin immintrin xmmintrin emmintrin omp cpuid unwind varargs lastlog gshadow gconv
proc_service syslimits stdfix quadmath stdio_ext gcov"""
#: Headers of C, C++, POSIX and of common C libraries, without their ending.
HEADERS = frozenset(_HEADERS.split())

_MATH = """acos asin atan atan2 cos sin tan acosh asinh atanh cosh sinh tanh exp exp2 exp10 expm1 frexp ilogb ldexp log
log10 log1p log2 logb modf scalb scalbn scalbln cbrt fabs hypot pow pow10 sqrt rsqrt erf erfc lgamma tgamma
gamma ceil floor nearbyint rint lrint llrint round lround llround roundeven trunc fmod remainder remquo
copysign nan nextafter nexttoward nextup nextdown fdim fmax fmin fma sincos drem finite significand j0 j1 jn
y0 y1 yn canonicalize cacos casin catan ccos csin ctan cacosh casinh catanh ccosh csinh ctanh cexp clog cpow
csqrt cabs carg cimag conj cproj creal"""
_C_LIBRARY = """isalnum isalpha isblank iscntrl isdigit isgraph islower isprint ispunct isspace isupper isxdigit tolower
toupper isascii toascii isnan isinf isfinite isnormal signbit fpclassify isgreater isless isunordered
feclearexcept fegetexceptflag feraiseexcept fesetexceptflag fetestexcept fegetround fesetround fegetenv
feholdexcept fesetenv feupdateenv imaxabs imaxdiv strtoimax strtoumax wcstoimax wcstoumax setlocale localeconv
setjmp longjmp signal raise remove rename tmpfile tmpnam fclose fflush fopen freopen setbuf setvbuf fprintf
fscanf printf scanf snprintf sprintf sscanf vfprintf vfscanf vprintf vscanf vsnprintf vsprintf vsscanf fgetc
fgets fputc fputs getc getchar gets putc putchar puts ungetc fread fwrite fgetpos fseek fsetpos ftell rewind
clearerr feof ferror perror atof atoi atol atoll strtod strtof strtold strtol strtoll strtoul strtoull rand
srand aligned_alloc calloc free malloc realloc abort atexit at_quick_exit exit getenv quick_exit system
bsearch qsort abs labs llabs div ldiv lldiv mblen mbtowc wctomb mbstowcs wcstombs memcpy memmove memccpy
strcpy strncpy strcat strncat memcmp strcmp strcoll strncmp strxfrm memchr strchr strcspn strpbrk strrchr
strspn strstr strtok memset memset_explicit strerror strlen strdup strndup clock difftime mktime time timegm
timespec_get asctime ctime gmtime localtime strftime btowc wctob mbsinit mbrlen mbrtowc wcrtomb mbsrtowcs
wcsrtombs fgetwc fputwc fwide getwc putwc wprintf wscanf wcscpy wcslen wcscmp wcscat wmemcpy wmemset call_once
main std stdin stdout stderr errno environ"""
_POSIX = """accept access alarm basename bcmp bcopy bind brk bzero chdir chmod chown close closedir connect creat
dirname
dlclose dlopen dlsym drand48 dup dup2 execv execve execvp fchmod fcntl fdopen ffs fileno flock fork fstat
fsync ftruncate getcwd getgid getline getopt getpid getuid index initstate ioctl isatty kill link listen
lrand48 lseek lstat mkdir mkfifo mknod mkstemp mmap mount mprotect msync munmap nanosleep nice open opendir
optarg optind opterr optopt pause pclose pipe poll popen pread putenv pwrite random read readdir readlink recv
rindex rmdir sbrk select send setenv setsid shutdown sigaction sleep socket srandom stat statfs stpcpy
strcasecmp strsep strsignal swab symlink sync syscall sysconf tee times timezone truncate tzname tzset umask
uname unlink unsetenv usleep utime vfork wait waitpid write daylight signgam"""
_REAL = _MATH.split()
#: Functions and objects of the libraries; of mathematics with the endings for float and long double.
FUNCTIONS = frozenset([*_REAL, *(f"{one}{end}" for one in _REAL for end in "fl"), *_C_LIBRARY.split(), *_POSIX.split()])

_PREFIXES = """atomic cnd mtx thrd tss sem pthread res tls memory mcount"""
#: Prefixes whose `_init`, or more, the libraries have: `mtx_init`, `sem_init`, `atomic_init`.
PREFIXES = frozenset(_PREFIXES.split())

_BUILDS = """test all all_build install preinstall package package_source help clean edit_cache rebuild_cache
list_install_components run_tests zero_check depend build debug optimized general vectors measure semihosting
start_cortex_m start_rv64 start_ppc64 square_root"""
#: Targets and words of CMake and make, and files that packages are built with on targets.
BUILDS = frozenset(_BUILDS.split())
