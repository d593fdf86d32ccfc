#include <embree4/rtcore.h>

/* bindgen drops two macros: one has a cast, and one has no value. Constants of the same names
   replace them. */

enum { invalid_geometry_id = RTC_INVALID_GEOMETRY_ID };
#undef RTC_INVALID_GEOMETRY_ID

/* The id of no geometry, primitive or instance. */
static const unsigned int RTC_INVALID_GEOMETRY_ID = invalid_geometry_id;

#if defined(RTC_GEOMETRY_INSTANCE_ARRAY)
enum { instance_array = 1 };
#undef RTC_GEOMETRY_INSTANCE_ARRAY
#else
enum { instance_array = 0 };
#endif

/* True if Embree was compiled with instance arrays. `RTCHit` then has a second id for each level
   of instancing. */
static const bool RTC_GEOMETRY_INSTANCE_ARRAY = instance_array;
