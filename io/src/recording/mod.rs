//! Stub.
#![allow(missing_docs)]
use std::path::Path;
pub struct Recording; #[derive(Default)] pub struct RecordingOptions{pub serve:bool,pub port:Option<u16>}
#[derive(Debug,thiserror::Error)] #[error("x")] pub struct RecordingTrouble;
impl vasos_engine::explain::Explain for RecordingTrouble { fn key(&self)->&'static str{"x"} fn args(&self)->Vec<(&'static str,String)>{vec![]} }
impl Recording { pub fn start(_p:&Path,_o:RecordingOptions)->Result<(Self,Box<dyn vasos_engine::session::Sink>),RecordingTrouble>{Err(RecordingTrouble)}
 pub fn id(&self)->u64{0} pub fn path(&self)->&Path{Path::new("")} pub fn address(&self)->Option<&str>{None} pub fn rows(&self)->u64{0} pub fn lost(&self)->u64{0} pub fn bytes(&self)->u64{0}
 pub fn troubles(&mut self)->Vec<RecordingTrouble>{vec![]} pub fn close(self)->Result<(),RecordingTrouble>{Ok(())} }
