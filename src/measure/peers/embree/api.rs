//! The part of Embree's C interface that is used, written down from the public headers of Embree 4 (rtcore_device.h,
//! rtcore_geometry.h, rtcore_scene.h, rtcore_common.h), and loaded at run time.

use std::ffi::{c_char, c_void};
use std::mem::ManuallyDrop;
use std::path::Path;

use libloading::Library;

/// An opaque handle of the library.
pub type Handle = *mut c_void;
/// `RTCErrorFunction`.
pub type ErrorFunction = unsafe extern "C" fn(user: Handle, code: u32, text: *const c_char);
/// `RTCMemoryMonitorFunction`: bytes are negative when memory is given back.
pub type MemoryFunction = unsafe extern "C" fn(user: Handle, bytes: isize, post: bool) -> bool;
/// `rtcIntersect1`, `rtcOccluded1`.
pub type SingleQuery = unsafe extern "C" fn(scene: Handle, rays: *mut u32, arguments: *mut Arguments);
/// `rtcIntersect4/8/16`, `rtcOccluded4/8/16`; `valid` holds -1 for lanes that are traced.
pub type PacketQuery =
    unsafe extern "C" fn(valid: *const u32, scene: Handle, rays: *mut u32, arguments: *mut Arguments);

/// `RTC_DEVICE_PROPERTY_VERSION`: 10000 major + 100 minor + patch, in every version since 3.
pub const PROPERTY_VERSION: u32 = 0;
/// `RTC_GEOMETRY_TYPE_TRIANGLE`.
pub const GEOMETRY_TRIANGLE: u32 = 0;
/// `RTC_GEOMETRY_TYPE_INSTANCE`.
pub const GEOMETRY_INSTANCE: u32 = 121;
/// `RTC_BUFFER_TYPE_INDEX`.
pub const BUFFER_INDEX: u32 = 0;
/// `RTC_BUFFER_TYPE_VERTEX`.
pub const BUFFER_VERTEX: u32 = 1;
/// `RTC_FORMAT_UINT3`.
pub const FORMAT_UINT3: u32 = 0x5003;
/// `RTC_FORMAT_FLOAT3`.
pub const FORMAT_FLOAT3: u32 = 0x9003;
/// `RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR`: three columns and the translation.
pub const FORMAT_FLOAT3X4: u32 = 0x9234;
/// `RTC_BUILD_QUALITY_HIGH`.
pub const QUALITY_HIGH: u32 = 2;
/// `RTC_SCENE_FLAG_NONE`.
pub const SCENE_NONE: u32 = 0;
/// `RTC_SCENE_FLAG_ROBUST`.
pub const SCENE_ROBUST: u32 = 1 << 2;
/// `RTC_RAY_QUERY_FLAG_COHERENT`; incoherent is no flag.
pub const QUERY_COHERENT: u32 = 1 << 16;

/// `RTCIntersectArguments` and `RTCOccludedArguments`, which have one layout. The last field exists in some builds
/// only; the others do not look at it.
#[repr(C)]
#[derive(Debug)]
pub struct Arguments {
    /// `RTCRayQueryFlags`.
    pub flags: u32,
    /// `RTCFeatureFlags`.
    pub feature_mask: u32,
    /// Context, filter and callback of user geometry: none.
    pub unused: [Handle; 3],
    /// `minWidthDistanceFactor`.
    pub min_width_distance_factor: f32,
}

impl Arguments {
    /// What `rtcInitIntersectArguments` sets, with the query flag `coherent`.
    pub fn new(coherent: bool) -> Self {
        let flags = if coherent { QUERY_COHERENT } else { 0 };
        Self { flags, feature_mask: u32::MAX, unused: [std::ptr::null_mut(); 3], min_width_distance_factor: 0.0 }
    }
}

/// Declares [`Api`] and the loading of each function by its name in the library.
macro_rules! api {
    ($($field:ident = $symbol:literal: $type:ty,)*) => {
        /// Functions of a loaded library.
        pub struct Api {
            // Never unloaded: threads of its task system may still run its code when the last scene is gone.
            _library: ManuallyDrop<Library>,
            $(#[doc = $symbol] pub $field: $type,)*
        }

        impl Api {
            fn resolve(library: Library) -> Result<Self, String> {
                $(
                    // SAFETY: the function with this name has this type in the headers of Embree 4 (and those that
                    // are called before the version is known, also in Embree 3's); the pointer is used no longer than
                    // the library, which stays loaded.
                    let $field = *unsafe { library.get::<$type>($symbol) }
                        .map_err(|e| format!("not an Embree 4 library, it has no {}: {}", $symbol, reason(&e)))?;
                )*
                Ok(Self { _library: ManuallyDrop::new(library), $($field,)* })
            }
        }
    };
}

api! {
    new_device = "rtcNewDevice": unsafe extern "C" fn(*const c_char) -> Handle,
    release_device = "rtcReleaseDevice": unsafe extern "C" fn(Handle),
    device_property = "rtcGetDeviceProperty": unsafe extern "C" fn(Handle, u32) -> isize,
    device_error = "rtcGetDeviceError": unsafe extern "C" fn(Handle) -> u32,
    set_error_function = "rtcSetDeviceErrorFunction": unsafe extern "C" fn(Handle, ErrorFunction, Handle),
    set_memory_function = "rtcSetDeviceMemoryMonitorFunction": unsafe extern "C" fn(Handle, MemoryFunction, Handle),
    new_geometry = "rtcNewGeometry": unsafe extern "C" fn(Handle, u32) -> Handle,
    set_buffer = "rtcSetSharedGeometryBuffer":
        unsafe extern "C" fn(Handle, u32, u32, u32, *const c_void, usize, usize, usize),
    commit_geometry = "rtcCommitGeometry": unsafe extern "C" fn(Handle),
    release_geometry = "rtcReleaseGeometry": unsafe extern "C" fn(Handle),
    new_scene = "rtcNewScene": unsafe extern "C" fn(Handle) -> Handle,
    set_scene_flags = "rtcSetSceneFlags": unsafe extern "C" fn(Handle, u32),
    set_build_quality = "rtcSetSceneBuildQuality": unsafe extern "C" fn(Handle, u32),
    attach = "rtcAttachGeometryByID": unsafe extern "C" fn(Handle, Handle, u32),
    set_instanced = "rtcSetGeometryInstancedScene": unsafe extern "C" fn(Handle, Handle),
    set_transform = "rtcSetGeometryTransform": unsafe extern "C" fn(Handle, u32, u32, *const c_void),
    commit_scene = "rtcCommitScene": unsafe extern "C" fn(Handle),
    release_scene = "rtcReleaseScene": unsafe extern "C" fn(Handle),
    intersect1 = "rtcIntersect1": SingleQuery,
    intersect4 = "rtcIntersect4": PacketQuery,
    intersect8 = "rtcIntersect8": PacketQuery,
    intersect16 = "rtcIntersect16": PacketQuery,
    occluded1 = "rtcOccluded1": SingleQuery,
    occluded4 = "rtcOccluded4": PacketQuery,
    occluded8 = "rtcOccluded8": PacketQuery,
    occluded16 = "rtcOccluded16": PacketQuery,
}

impl Api {
    /// Loads the library at `path`, or by name from the system's library path.
    ///
    /// # Errors
    /// Why not, in the system's words.
    pub fn load(path: &Path) -> Result<Self, String> {
        // SAFETY: loading runs the library's initialisers, which is what whoever names the library asks for; Embree's
        // and TBB's only set up their own data.
        let library = unsafe { Library::new(path) }.map_err(|e| reason(&e))?;
        Self::resolve(library)
    }
}

/// The system's own words, which libloading keeps behind its error.
fn reason(error: &libloading::Error) -> String {
    std::error::Error::source(error).map_or_else(|| error.to_string(), ToString::to_string)
}
