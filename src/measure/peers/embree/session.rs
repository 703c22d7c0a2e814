//! A device and a scene of a loaded Embree.

use std::ffi::{CStr, CString, c_char, c_void};
use std::path::Path;
use std::sync::atomic::{AtomicI64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use super::api::{self, Api, Arguments, Handle};
use super::probe;
use crate::measure::peers::triangles::{PlacedObject, PlacedTriangles, Triangles};

/// What the library tells us from within its calls.
#[derive(Default)]
struct Reports {
    error: Mutex<Option<String>>,
    bytes: AtomicI64,
}

/// A device with one committed scene. Queries may come from any number of threads.
pub struct Session {
    api: Arc<Api>,
    device: Handle,
    scene: Handle,
    /// Scenes of objects that are placed several times.
    objects: Vec<Handle>,
    reports: Box<Reports>,
    // Embree reads the vertices where they are for as long as the scene lives.
    _triangles: Arc<PlacedTriangles>,
    /// Seconds of committing geometry and scene.
    pub build_seconds: f64,
    /// Rows of a packet with hits in this build of the library.
    pub hit_rows: usize,
    /// Major, minor and patch number.
    pub version: [u32; 3],
}

// SAFETY: a committed scene that is only queried may be used by several threads at once, and a device and a scene may
// be released by any thread (Embree's manual, "Thread safety"); everything else here is Send and Sync by itself.
unsafe impl Send for Session {}
// SAFETY: as above.
unsafe impl Sync for Session {}

impl Session {
    /// Opens the library at `path` and builds a scene with quality HIGH.
    ///
    /// # Errors
    /// Why this library cannot be used.
    pub fn open(path: &Path, triangles: Arc<PlacedTriangles>, threads: usize, robust: bool) -> Result<Self, String> {
        let api = Arc::new(Api::load(path)?);
        let config = format!("threads={threads},start_threads=1,hugepages=1{}", super::widest().1);
        let config = CString::new(config).map_err(|e| e.to_string())?;
        // SAFETY: the configuration is a string that ends in zero and lives through the call.
        let device = unsafe { (api.new_device)(config.as_ptr()) };
        if device.is_null() {
            // SAFETY: a null device asks for the calling thread's error.
            let code = unsafe { (api.device_error)(std::ptr::null_mut()) };
            return Err(format!("it gives no device: {}", name_of(code)));
        }
        // From here on dropping releases what there is.
        let mut session = Self {
            api,
            device,
            scene: std::ptr::null_mut(),
            objects: Vec::new(),
            reports: Box::default(),
            _triangles: triangles.clone(),
            build_seconds: 0.0,
            hit_rows: 0,
            version: [0; 3],
        };
        session.version = session.read_version();
        if session.version[0] != 4 {
            let [major, minor, patch] = session.version;
            return Err(format!("it is Embree {major}.{minor}.{patch}; only Embree 4 is supported"));
        }
        session.listen();
        session.hit_rows = probe::hit_rows(&session)?;
        session.reports.bytes.store(0, Ordering::Relaxed);
        let start = Instant::now();
        for object in &triangles.objects {
            let scene = session.build(object, &[], robust)?;
            session.objects.push(scene);
        }
        session.scene = session.build(&triangles.world, &triangles.instances, robust)?;
        session.build_seconds = start.elapsed().as_secs_f64();
        Ok(session)
    }

    fn read_version(&self) -> [u32; 3] {
        // SAFETY: the device is live; the property exists since version 3.
        let version = unsafe { (self.api.device_property)(self.device, api::PROPERTY_VERSION) };
        let version = u32::try_from(version).unwrap_or(0);
        [version / 10_000, version / 100 % 100, version % 100]
    }

    fn listen(&self) {
        let user: Handle = (&raw const *self.reports).cast_mut().cast();
        // SAFETY: the device is live; the reports are boxed, so they stay where they are, and are freed after the
        // device is released, see Drop. The callbacks share them between threads, which their types allow.
        unsafe {
            (self.api.set_error_function)(self.device, on_error, user);
            (self.api.set_memory_function)(self.device, on_memory, user);
        }
    }

    /// The first error since the last call.
    ///
    /// # Errors
    /// That error.
    pub fn check(&self) -> Result<(), String> {
        // SAFETY: the device is live.
        let code = unsafe { (self.api.device_error)(self.device) };
        let text = self.reports.error.lock().unwrap_or_else(PoisonError::into_inner).take();
        match (code, text) {
            (0, None) => Ok(()),
            (code, text) => Err(format!("it reports {}: {}", name_of(code), text.unwrap_or_default())),
        }
    }

    /// A committed scene of one triangle geometry over buffers that outlive it (none if there are no triangles) and of
    /// instances of the objects built so far. Geometry `i` is instance `i`; the triangles come after them.
    ///
    /// # Errors
    /// What the library reports.
    pub(super) fn build(
        &self,
        triangles: &Triangles,
        instances: &[PlacedObject],
        robust: bool,
    ) -> Result<Handle, String> {
        let flags = if robust { api::SCENE_ROBUST } else { api::SCENE_NONE };
        let api = &self.api;
        // SAFETY: the device is live.
        let scene = unsafe { (api.new_scene)(self.device) };
        for (id, placed) in instances.iter().enumerate() {
            // SAFETY: the device, the new scene and the object's committed scene are live; the map has twelve floats,
            // which are copied. The scene holds a reference to the geometry and that one to the object's scene.
            unsafe {
                let geometry = (api.new_geometry)(self.device, api::GEOMETRY_INSTANCE);
                (api.set_instanced)(geometry, self.objects[placed.object as usize]);
                (api.set_transform)(geometry, 0, api::FORMAT_FLOAT3X4, placed.to_world.as_ptr().cast());
                (api.commit_geometry)(geometry);
                (api.attach)(scene, geometry, id as u32);
                (api.release_geometry)(geometry);
            }
        }
        if !triangles.indices.is_empty() {
            self.attach(scene, triangles, instances.len() as u32);
        }
        // SAFETY: the scene is live, and nobody else knows it yet.
        unsafe {
            (api.set_scene_flags)(scene, flags);
            (api.set_build_quality)(scene, api::QUALITY_HIGH);
            (api.commit_scene)(scene);
        }
        self.check().inspect_err(|_| self.release(scene))?;
        Ok(scene)
    }

    /// Adds triangles to a scene; their buffers outlive it.
    fn attach(&self, scene: Handle, Triangles { vertices, indices, .. }: &Triangles, id: u32) {
        let (api, from) = (&self.api, |data: *const c_void| data);
        let (float3, uint3) = (api::FORMAT_FLOAT3, api::FORMAT_UINT3);
        // SAFETY: the device and the scene are live, the geometry is used before it is released, the strides are those of
        // the slices, indices are in range of the vertices, and each vertex can be read as 16 bytes. The caller keeps both
        // slices until the scene is released. The scene holds a reference to the geometry, so ours can go.
        unsafe {
            let geometry = (api.new_geometry)(self.device, api::GEOMETRY_TRIANGLE);
            let vertex_data = from(vertices.as_ptr().cast());
            (api.set_buffer)(geometry, api::BUFFER_VERTEX, 0, float3, vertex_data, 0, 16, vertices.len());
            let index_data = from(indices.as_ptr().cast());
            (api.set_buffer)(geometry, api::BUFFER_INDEX, 0, uint3, index_data, 0, 12, indices.len());
            (api.commit_geometry)(geometry);
            (api.attach)(scene, geometry, id);
            (api.release_geometry)(geometry);
        }
    }

    /// Releases a scene of [`Session::build`].
    pub(super) fn release(&self, scene: Handle) {
        if !scene.is_null() {
            // SAFETY: the scene came from this library and nobody uses it after this call.
            unsafe { (self.api.release_scene)(scene) };
        }
    }

    /// Bytes the library holds for the scene.
    pub fn bytes(&self) -> u64 {
        u64::try_from(self.reports.bytes.load(Ordering::Relaxed)).unwrap_or(0)
    }

    /// Traces one packet in the scene of this Embree device, see [`Session::query_in`].
    #[inline(always)]
    pub fn query<const N: usize, const ANY: bool>(&self, valid: &[u32], packet: &mut [u32], arguments: &mut Arguments) {
        self.query_in::<N, ANY>(self.scene, valid, packet, arguments);
    }

    /// Traces one packet of [`super::layout::Packets`]; with `ANY`, rows of hits are not touched.
    #[inline(always)]
    pub(super) fn query_in<const N: usize, const ANY: bool>(
        &self,
        scene: Handle,
        valid: &[u32],
        packet: &mut [u32],
        arguments: &mut Arguments,
    ) {
        let api = &self.api;
        let (valid, packet, arguments) = (valid.as_ptr(), packet.as_mut_ptr(), &raw mut *arguments);
        // SAFETY: the scene is committed and not null; `valid` has N numbers and `packet` the rows of a ray, and of a
        // hit unless ANY, as many as the probe found, both aligned by `Packets`; the arguments live through the call.
        // N is 1, 4, 8 or 16, a width each of these functions has.
        unsafe {
            match (N, ANY) {
                (1, false) => (api.intersect1)(scene, packet, arguments),
                (4, false) => (api.intersect4)(valid, scene, packet, arguments),
                (8, false) => (api.intersect8)(valid, scene, packet, arguments),
                (16, false) => (api.intersect16)(valid, scene, packet, arguments),
                (1, true) => (api.occluded1)(scene, packet, arguments),
                (4, true) => (api.occluded4)(valid, scene, packet, arguments),
                (8, true) => (api.occluded8)(valid, scene, packet, arguments),
                (16, true) => (api.occluded16)(valid, scene, packet, arguments),
                _ => unreachable!("packets have 1, 4, 8 or 16 lanes"),
            }
        }
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        self.release(self.scene);
        self.objects.iter().for_each(|&object| self.release(object));
        // SAFETY: the device came from this library; its scenes are gone, and nobody uses it after this.
        unsafe { (self.api.release_device)(self.device) };
    }
}

unsafe extern "C" fn on_error(user: Handle, code: u32, text: *const c_char) {
    // SAFETY: `user` is the session's reports, see `listen`.
    let reports = unsafe { &*user.cast::<Reports>() };
    let text = match text.is_null() {
        true => name_of(code).to_string(),
        // SAFETY: not null, and a string that ends in zero by the interface.
        false => unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned(),
    };
    reports.error.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(text);
}

unsafe extern "C" fn on_memory(user: Handle, bytes: isize, _post: bool) -> bool {
    // SAFETY: `user` is the session's reports, see `listen`.
    let reports = unsafe { &*user.cast::<Reports>() };
    reports.bytes.fetch_add(bytes as i64, Ordering::Relaxed);
    true
}

/// `RTCError` in words.
fn name_of(code: u32) -> &'static str {
    match code {
        0 => "no error",
        2 => "an invalid argument",
        3 => "an invalid operation",
        4 => "out of memory",
        5 => "an unsupported CPU",
        6 => "a cancelled build",
        _ => "an unknown error",
    }
}
